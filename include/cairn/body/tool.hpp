#pragma once
/// Tools: what acts on bodies from outside and feels their force. Numbered by the case: faces (2 x direction + side)
/// from 0, then drives, then the rigid bodies that no drive moves.

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "cairn/core/motion_table.hpp"

namespace cairn {

inline constexpr int tools_of_faces = 6;

/// What bodies did to a tool at the nodes that a patch answers for.
struct ToolSum {
  static constexpr int size = 7;
  std::array<double, size> total{};  // since the start: impulse [N s], its moment about the origin [N m s], work that
                                     // the tool did on bodies [J]
  std::array<double, 6> last{};      // in the last step: impulse and moment

  /// Adds an impulse on the tool [N s] at x [m], and the work that it did [J].
  void add(const Vec3& impulse, const Vec3& x, double work) {
    const Vec3 moment = x.cross(impulse);
    for (int i = 0; i < 3; ++i) {
      last[i] += impulse[i], last[3 + i] += moment[i];
      total[i] += impulse[i], total[3 + i] += moment[i];
    }
    total[6] += work;
  }
  void add(const ToolSum& other) {
    for (int i = 0; i < size; ++i) total[i] += other.total[i];
    for (std::size_t i = 0; i < last.size(); ++i) last[i] += other.last[i];
  }
};

/// A weight that slides along a direction under a given force and what bodies press:
/// mass dv/dt = force + (what bodies press) . along - damping v, |v| <= largest.
/// A servo is one as light as a few cells of material, with the damping that gives it the velocity
/// (force - what presses back) / damping.
struct Piston {
  double mass = 0;                                           // [kg]; 0: not a piston
  Vec3 along = Vec3::Zero();                                 // unit
  MotionTable force;                                         // its x component [N], or [Pa] where it is a pressure
  double damping = 0;                                        // [N s/m]; of a servo 1 / gain
  double gain = 0;                                           // of a servo [m/(N s)]; 0: not a servo
  double largest = std::numeric_limits<double>::infinity();  // [m/s]
  bool pressure = false;                                     // the force is that of a pressure on an area
  double area = 0;  // [m^(Dim-1)]; 0: of the face between the other faces, where they stand
};

/// The velocity that a piston gains in dt [m/s], where bodies press it with an impulse along its direction [N s].
inline double gained(const Piston& piston, double speed, double force, double pressed, double dt) {
  return (dt * force + pressed - dt * piston.damping * speed) / (piston.mass + dt * piston.damping);
}

/// Numbers of a tool's state.
inline constexpr int tool_state_size = 11;

/// What a tool is, and where it stands.
struct Tool {
  std::string name;
  Vec3 centre = Vec3::Zero();  // at the start; of a face its middle [m]
  MotionTable velocity, spin;  // as given [m/s, rad/s]
  Piston piston;
  Piston rotor;  // the same of a turn about an axis: inertia [kg m2], moment [N m], damping [N m s]
  // State:
  double speed = 0, turning = 0;                           // of piston and rotor along their directions [m/s, rad/s]
  Vec3 travel = Vec3::Zero();                              // since the start [m]
  Vec3 now = Vec3::Zero(), next = Vec3::Zero();            // velocity at the start and the end of the step [m/s]
  Vec3 spin_now = Vec3::Zero(), spin_next = Vec3::Zero();  // likewise [rad/s]

  std::array<double, tool_state_size> state() const {
    return {travel[0],   travel[1],   travel[2],   now[0], now[1], now[2],
            spin_now[0], spin_now[1], spin_now[2], speed,  turning};
  }
  void restore(const double* s) {
    travel = Vec3(s[0], s[1], s[2]), now = next = Vec3(s[3], s[4], s[5]);
    spin_now = spin_next = Vec3(s[6], s[7], s[8]), speed = s[9], turning = s[10];
  }

  bool is_pushed() const { return piston.mass > 0 || rotor.mass > 0; }
  bool turns() const { return rotor.mass > 0 || !spin.is_zero(); }
  bool moves() const { return is_pushed() || velocity.varies() || spin.varies(); }
  Vec3 place() const { return centre + travel; }
  /// Velocity and spin with which it moves in the step.
  Vec3 of_step() const { return piston.mass > 0 ? next : Vec3(0.5 * (now + next)); }
  Vec3 spin_of_step() const { return rotor.mass > 0 ? spin_next : Vec3(0.5 * (spin_now + spin_next)); }
};

}  // namespace cairn
