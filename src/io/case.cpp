#include "cairn/io/case.hpp"

#include "case_sections.hpp"

namespace cairn {

Case read_case(const std::filesystem::path& file, const std::vector<Override>& overrides) {
  using namespace reading;
  toml::table tree = parse_file(file, "a case file (TOML)");
  Errors errors(file.string());
  apply_overrides(tree, overrides, errors);

  Table root(&tree, "", {file.string(), 1}, errors);
  Draft draft;
  Case& c = draft.result;
  c.file = file;
  c.title = root.text("title", "");
  const std::size_t before = errors.count();
  read_domain(root.table("domain"), c.domain);
  draft.domain_known = errors.count() == before;
  read_time(root.table("time"), root.has("stage"), c.time);
  read_solver(root.table("solver"), c.domain.dimension, c.solver);
  read_materials(root.table("materials"), c.domain.dimension, c.materials);
  read_contact(root.table("contact"), c.materials, c.contact);
  read_bodies(root, draft, errors);
  read_grains(root, draft, errors);
  read_labels(root, draft, errors);
  read_pouring(root, draft, errors);
  if (!root.has("bodies") && !root.has("grains") && !root.has("labels") && !root.has("insert"))
    root.missing("bodies", "no body is given; give at least one [[bodies]], [[grains]] or [[labels]]");
  read_drives(root, draft);
  read_cracks(root, draft);
  read_deform(root.table("domain").table("deform"), draft);
  check_pressures(draft, errors);
  read_boundary(root.table("boundary"), draft);
  read_damping(root.table("damping"), c.solver.stress_update, c.damping);
  read_parallel(root.table("parallel"), c.parallel);
  read_output(root.table("output"), draft, c.output);
  read_stages(tree, root, draft, errors);
  root.finish();
  if (errors.count() == 0 && c.bodies.empty())
    root.missing("bodies", "no body is given; give at least one [[bodies]], [[grains]] or [[labels]]");
  errors.throw_if_any();
  check_walls(c, errors);
  check_points(c, errors);
  check_time_step(c, errors);
  errors.throw_if_any();

  warn_about_bodies(c);
  c.resolved = write_case(draft);
  return std::move(draft.result);
}

}  // namespace cairn
