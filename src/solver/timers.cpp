#include "cairn/solver/timers.hpp"

namespace cairn {

StageTimers::Scope StageTimers::measure(Stage stage) { return {*this, stage}; }

}  // namespace cairn
