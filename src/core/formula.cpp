#include "cairn/core/formula.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <cmath>
#include <numbers>

#include "cairn/core/error.hpp"

namespace cairn {

struct Formula::Parser {
  double t = 0;
  mu::Parser parser;
};

Formula::Formula(std::string text) : text_(std::move(text)), parser_(std::make_shared<Parser>()) {
  try {
    parser_->parser.DefineVar("t", &parser_->t);
    parser_->parser.DefineConst("pi", std::numbers::pi);
    parser_->parser.SetExpr(text_);
    parser_->parser.Eval();
  } catch (const mu::Parser::exception_type& error) {
    throw InputError(fmt::format("is no formula of t: {}", error.GetMsg()));
  }
}

double Formula::at(double t) const {
  parser_->t = t;
  const double value = parser_->parser.Eval();
  if (!std::isfinite(value)) throw RunError(fmt::format("the formula \"{}\" is {} at t = {} s", text_, value, t));
  return value;
}

}  // namespace cairn
