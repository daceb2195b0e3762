#pragma once
/// Names of the choices in the case file.

#include "case_reader.hpp"

namespace cairn::reading {

inline constexpr Named<ShapeFunction> shape_function_names[] = {
    {"linear", ShapeFunction::linear}, {"gimp", ShapeFunction::gimp}, {"bspline2", ShapeFunction::bspline2}};
inline constexpr Named<StressUpdate> stress_update_names[] = {{"last", StressUpdate::last},
                                                              {"first", StressUpdate::first},
                                                              {"both", StressUpdate::both},
                                                              {"modified_last", StressUpdate::modified_last}};
inline constexpr Named<ContactLaw> contact_law_names[] = {{"none", ContactLaw::none},
                                                          {"stick", ContactLaw::stick},
                                                          {"frictionless", ContactLaw::frictionless},
                                                          {"friction", ContactLaw::friction}};
inline constexpr Named<Release> release_names[] = {
    {"approach", Release::approach}, {"traction", Release::traction}, {"reaction", Release::reaction}};
inline constexpr Named<GapRule> gap_rule_names[] = {{"pressure", GapRule::pressure}, {"fill", GapRule::fill}};
inline constexpr Named<NormalSource> normal_source_names[] = {{"density", NormalSource::density},
                                                              {"mass_gradient", NormalSource::mass_gradient},
                                                              {"volume_gradient", NormalSource::volume_gradient}};
inline constexpr Named<NormalChoice> normal_choice_names[] = {{"common", NormalChoice::common},
                                                              {"own", NormalChoice::own}};
inline constexpr Named<Gate> gate_names[] = {{"node", Gate::node}, {"body", Gate::body}};
inline constexpr Named<DepartingFriction> departing_friction_names[] = {{"none", DepartingFriction::none},
                                                                        {"coulomb", DepartingFriction::coulomb},
                                                                        {"printed", DepartingFriction::printed}};
inline constexpr Named<Passes> passes_names[] = {
    {"both", Passes::both}, {"before", Passes::before}, {"after", Passes::after}};
inline constexpr Named<FaceType> face_type_names[] = {
    {"free", FaceType::free}, {"fixed", FaceType::fixed}, {"symmetry", FaceType::symmetry}, {"wall", FaceType::wall}};
inline constexpr Named<Leaving> leaving_names[] = {{"remove", Leaving::remove}, {"stop", Leaving::stop}};
inline constexpr Named<LostPoints> lost_points_names[] = {{"stop", LostPoints::stop}, {"drop", LostPoints::drop}};
inline constexpr Named<CrackLaw> crack_law_names[] = {
    {"stick", CrackLaw::stick}, {"friction", CrackLaw::friction},   {"frictionless", CrackLaw::frictionless},
    {"free", CrackLaw::free},   {"interface", CrackLaw::interface}, {"cohesive", CrackLaw::cohesive}};
inline constexpr Named<CohesiveShape> cohesive_shape_names[] = {{"triangle", CohesiveShape::triangle},
                                                                {"linear", CohesiveShape::linear},
                                                                {"exponential", CohesiveShape::exponential}};
inline constexpr Named<GrowthCriterion> growth_criterion_names[] = {
    {"hoop", GrowthCriterion::hoop}, {"energy", GrowthCriterion::energy}, {"steady", GrowthCriterion::steady}};
inline constexpr Named<GrowthDirection> growth_direction_names[] = {{"straight", GrowthDirection::straight},
                                                                    {"hoop", GrowthDirection::hoop}};
inline constexpr Named<CrackEnd> crack_end_names[] = {{"open", CrackEnd::open}, {"tip", CrackEnd::tip}};
inline constexpr Named<Surface> surface_names[] = {{"whole", Surface::whole}, {"cut", Surface::cut}};
inline constexpr Named<NoiseFilter> noise_filter_names[] = {{"off", NoiseFilter::off},
                                                            {"weak", NoiseFilter::weak},
                                                            {"strong", NoiseFilter::strong},
                                                            {"xpic", NoiseFilter::xpic}};
inline constexpr Named<Plane> plane_names[] = {{"strain", Plane::strain}, {"stress", Plane::stress}};
inline constexpr Named<Partition> partition_names[] = {{"metis", Partition::metis},
                                                       {"round_robin", Partition::round_robin}};
inline constexpr Named<int> face_index_names[] = {{"left", 0}, {"right", 1}, {"bottom", 2},
                                                  {"top", 3},  {"back", 4},  {"front", 5}};
inline constexpr Named<CompoundOperation> compound_names[] = {{"union", CompoundOperation::union_of},
                                                              {"difference", CompoundOperation::difference},
                                                              {"intersection", CompoundOperation::intersection}};

/// Fields of the particle files that every point has, beside the position, which is always written.
inline constexpr std::string_view particle_fields[] = {
    "velocity", "stress", "body", "id", "volume", "mass", "deformation_gradient", "image", "spin", "stress_smooth"};
inline constexpr std::size_t default_particle_fields = 6;  // the first six

}  // namespace cairn::reading
