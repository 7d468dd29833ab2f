// The objects behind the C ABI's opaque pointers.
#pragma once

#include <cstdint>
#include <utility>

#include <lightwell/lighting.hpp>
#include <lightwell/lightwell.h>
#include <lightwell/probe.hpp>

namespace lightwell::c {

/// First word of a handle, by which its type is checked. The destructor clears it, so that use after release is usually
/// detected; not always, because the memory may have been reused.
class HandleTag {
 public:
  explicit HandleTag(std::uint64_t kind) : word_(kind) {}
  HandleTag(const HandleTag&) = delete;
  HandleTag& operator=(const HandleTag&) = delete;
  ~HandleTag() { word_ = 0; }

  [[nodiscard]] bool is(std::uint64_t kind) const { return word_ == kind; }

 private:
  volatile std::uint64_t word_;  ///< volatile, so that the compiler does not remove the destructor's store.
};

inline constexpr std::uint64_t kProbeTag = 0x65626f72705f776cU;     // "lw_probe"
inline constexpr std::uint64_t kLightingTag = 0x6e697468676c776cU;  // "lwlghtin"

}  // namespace lightwell::c

struct lw_probe {
  explicit lw_probe(lightwell::Probe connected) : value(std::move(connected)) {}
  lightwell::c::HandleTag tag{lightwell::c::kProbeTag};
  lightwell::Probe value;
};

struct lw_lighting {
  lightwell::c::HandleTag tag{lightwell::c::kLightingTag};
  lightwell::Lighting value;
};

namespace lightwell::c {

[[nodiscard]] inline bool aligned(const void* p) {
  return reinterpret_cast<std::uintptr_t>(p) % alignof(HandleTag) == 0;
}

[[nodiscard]] inline bool good(const lw_probe* p) { return p != nullptr && aligned(p) && p->tag.is(kProbeTag); }
[[nodiscard]] inline bool good(const lw_lighting* p) { return p != nullptr && aligned(p) && p->tag.is(kLightingTag); }

}  // namespace lightwell::c
