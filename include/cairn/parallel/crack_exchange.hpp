#pragma once
/// Crack points go with the patch whose cells hold them, and patches know those of their neighbours that are near.

#include <string>

#include "cairn/crack/faces.hpp"
#include "cairn/parallel/communicator.hpp"
#include "cairn/parallel/distribution.hpp"

namespace cairn {

/// Cells beyond a patch within which it knows crack points: whatever segment its points and nodes may have between
/// them, and the segment beyond an open end. Patches have at least as many cells.
inline constexpr double crack_reach = 4;

/// Whether a patch's cells hold a crack point: in its frame, those nearest to what lies beyond a face of the domain.
template <int Dim>
bool holds(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const CrackPoint<Dim>& point);

/// Sends the patches' own crack points, which may have moved up to a patch, to the patches whose cells hold them now
/// and to those nearby, where these are in the table. Lists become ascending; the same on any number of ranks.
/// Collective. What went wrong on this rank, empty if nothing: a point that left the domain or moved further.
template <int Dim>
std::string exchange_cracks(NeighbourExchange& messages, const PatchTable<Dim>& table, std::vector<Patch<Dim>>& patches,
                            const Lattice<Dim>& lattice);

/// Tells the owners of crack points what their neighbours found of faces that lie with them; `told` for each patch.
/// Where several tell, the patch that comes first counts. Collective.
template <int Dim>
void exchange_face_velocities(NeighbourExchange& messages, const PatchTable<Dim>& table,
                              std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice,
                              const std::vector<std::vector<FaceMotion<Dim>>>& told);

/// Gives every patch the forces that neighbours' crack points put on its nodes, beside its own, in the order in which
/// they are added; `forces` for each patch. Collective.
template <int Dim>
void exchange_row_forces(NeighbourExchange& messages, const PatchTable<Dim>& table,
                         const std::vector<Patch<Dim>>& patches, const Lattice<Dim>& lattice,
                         std::vector<std::vector<RowForce<Dim>>>& forces);

/// Puts a crack point into a message, and takes it from there.
template <int Dim>
void put_crack_point(const CrackPoint<Dim>& point, Message& message);
template <int Dim>
CrackPoint<Dim> take_crack_point(const Message& message, std::size_t& at);

}  // namespace cairn
