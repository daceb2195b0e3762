#include "cairn/io/checksum.hpp"

#include <xxhash.h>

#include <new>

namespace cairn {

void Checksum::Free::operator()(XXH64_state_s* state) const { XXH64_freeState(state); }

Checksum::Checksum() : state_(XXH64_createState()) {
  if (!state_ || XXH64_reset(state_.get(), 0) != XXH_OK) throw std::bad_alloc();
}

void Checksum::add(std::span<const std::byte> bytes) {
  if (!bytes.empty()) XXH64_update(state_.get(), bytes.data(), bytes.size());
}

std::uint64_t Checksum::value() const { return XXH64_digest(state_.get()); }

}  // namespace cairn
