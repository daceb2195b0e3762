#pragma once
/// Arrays on 64-byte boundaries, so that no vector loop depends on an address.

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

namespace cairn {

/// Allocator that starts every array on a cache line and leaves plain numbers uninitialised on resize.
template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>& /*other*/) {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new (n * sizeof(T), std::align_val_t{64})); }
  void deallocate(T* p, std::size_t /*n*/) { ::operator delete (p, std::align_val_t{64}); }
  template <class U>
  void construct(U* p) {
    ::new (static_cast<void*>(p)) U;
  }
  template <class U, class... Arguments>
  void construct(U* p, Arguments&&... arguments) {
    ::new (static_cast<void*>(p)) U(static_cast<Arguments&&>(arguments)...);
  }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
};

using AlignedDoubles = std::vector<double, AlignedAllocator<double>>;

/// Brings n numbers to the cache, many lines at once. By loads: of so many prefetches at once most would be dropped.
inline void fetch(const double* values, std::size_t n) {
  constexpr std::size_t line = 64 / sizeof(double);
  for (std::size_t i = 0; i < n; i += line) asm volatile("" ::"x"(values[i]));
}

/// Arrays whose contents are needed for a while only. Few serve many users one after the other, and stay in the cache.
class ArrayPool {
 public:
  /// Gives `to` an array with any contents, if there is one and it has none.
  void lend(AlignedDoubles& to) {
    if (to.capacity() > 0 || free_.empty()) return;
    to = std::move(free_.back());
    free_.pop_back();
  }
  /// Leaves `from` empty.
  void take_back(AlignedDoubles& from) {
    if (from.capacity() > 0) free_.push_back(std::exchange(from, {}));
  }

 private:
  std::vector<AlignedDoubles> free_;
};

/// Changes the size without room for more and without keeping the values.
inline void resize_exactly(AlignedDoubles& values, std::size_t size) {
  if (values.capacity() < size) {
    values = AlignedDoubles();
    values.reserve(size);
  }
  values.resize(size);
}

}  // namespace cairn
