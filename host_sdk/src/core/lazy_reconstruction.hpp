// The reconstruction of a descriptor's radiance, computed when the first query needs it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include <lightwell/geometry.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/reconstruction.hpp>

namespace lightwell::core {

/// reconstruct() takes hundreds of microseconds, and irradiance does not need it. Derived values (between two
/// descriptors, in a rotated frame) transform the reconstructions of the received descriptors, which takes
/// microseconds. All const functions may be called by any thread; none waits for another thread, none allocates.
class LazyReconstruction {
 public:
  using Pointer = std::shared_ptr<const LazyReconstruction>;

  explicit LazyReconstruction(const RadianceSh& sh) : sh_(sh) {}
  /// interpolated(a, b, f).
  LazyReconstruction(Pointer a, Pointer b, float f) : a_(std::move(a)), b_(std::move(b)), f_(f) {}
  /// rotated(from, q). A rotation of a rotation refers to the unrotated ones: no chain grows.
  LazyReconstruction(const Pointer& from, Quat q);

  /// Null where it was not computed yet. Counts as a query.
  [[nodiscard]] const RadianceReconstruction* ready() const;
  /// Computes and keeps it. If another thread is keeping its own result at this moment, this one is only returned.
  [[nodiscard]] RadianceReconstruction compute() const;
  /// Whether a query came, to this or to one derived from it.
  [[nodiscard]] bool queried() const { return queried_.load(std::memory_order_relaxed); }

 private:
  enum class State : std::uint8_t { empty, writing, ready };

  [[nodiscard]] RadianceReconstruction value() const;

  RadianceSh sh_;  // Of a received descriptor: a_ is null.
  Pointer a_, b_;  // Of a derived one; b_ is null where there is one source.
  float f_ = 0;
  std::optional<Quat> q_;
  mutable std::atomic<bool> queried_ = false;
  mutable std::atomic<State> state_ = State::empty;
  mutable RadianceReconstruction kept_;
};

/// While an application queries radiance(), the reader thread computes what the next query needs; it computes nothing
/// for one that queries irradiance alone. The reader thread's own.
class ReconstructAhead {
 public:
  /// Descriptors in succession whose radiance nobody queries, after which it computes nothing: an application may
  /// render less often than descriptors come.
  static constexpr unsigned kMaxWithoutQuery = 16;

  /// A descriptor was published: its reconstruction and that of the one before, null where there is none.
  void published(const LazyReconstruction* before, const LazyReconstruction* newest);

 private:
  unsigned without_query_ = kMaxWithoutQuery;
};

}  // namespace lightwell::core
