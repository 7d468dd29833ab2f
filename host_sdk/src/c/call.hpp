// Common parts of the functions of the C ABI: the objects behind the opaque pointers, exceptions and messages, and
// versioned structs, whose `size` the caller sets because it differs between versions of the header.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/lightwell.h>
#include <lightwell/probe.hpp>
#include <lightwell/result.hpp>

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

}  // namespace lightwell::c

struct lw_probe {
  static constexpr std::uint64_t kKind = 0x65626f72705f776cU;  // "lw_probe"
  static constexpr const char* kRefusal = "this is not an lw_probe of lw_probe_connect";

  explicit lw_probe(lightwell::Probe connected) : value(std::move(connected)) {}
  lightwell::c::HandleTag tag{kKind};
  lightwell::Probe value;
};

struct lw_lighting {
  static constexpr std::uint64_t kKind = 0x6e697468676c776cU;  // "lwlghtin"
  static constexpr const char* kRefusal = "this is not an lw_lighting of lw_lighting_create";

  lightwell::c::HandleTag tag{kKind};
  lightwell::Lighting value;
};

namespace lightwell::c {

template <class Handle>
[[nodiscard]] bool good(const Handle* p) {
  return p != nullptr && reinterpret_cast<std::uintptr_t>(p) % alignof(HandleTag) == 0 && p->tag.is(Handle::kKind);
}

/// Stores the message for lw_last_error(), truncated between two characters if it is too long. Allocates nothing, so
/// that it can report a lack of memory.
lw_status failed(StatusCode code, std::string_view message) noexcept;

inline Status invalid(std::string message) { return {StatusCode::invalid_argument, std::move(message)}; }
inline Status null_argument(const char* name) { return invalid(std::string(name) + " is NULL"); }

/// `work` returns a Status.
template <class Work>
lw_status call(const Work& work) noexcept {
  try {
    const Status status = work();
    return status.ok() ? LW_OK : failed(status.code(), status.message());
  } catch (const std::bad_alloc&) {
    return failed(StatusCode::resource_exhausted, "no memory is left");
  } catch (const std::system_error& e) {
    // std::thread could not be started.
    return failed(StatusCode::resource_exhausted, e.what());
  } catch (const std::exception& e) {
    return failed(StatusCode::internal, e.what());
  } catch (...) {
    return failed(StatusCode::internal, "an exception of unknown type");
  }
}

/// Creates an object with a default constructor.
template <class Handle>
lw_status create(Handle** out) noexcept {
  return call([&]() -> Status {
    if (out == nullptr) return invalid("out is NULL; pass the address of a pointer for the object");
    *out = std::make_unique<Handle>().release();
    return {};
  });
}

/// Checks the handle, then runs `work(object)`, which returns a Status; the object is const if the handle is. Messages
/// are literals, so that a successful call constructs no string.
template <class Handle, class Work>
lw_status with_handle(Handle* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, Handle::kRefusal);
  return call([&] { return work(handle->value); });
}

template <class Into>
Status not_to_be_filled() {
  return invalid(std::string("`into`: ") + Into::kRefusal);
}

/// Fills `into` with the value that `make(object)` returns, or returns its error.
template <class Handle, class Into, class Make>
lw_status fill(Handle* handle, Into* into, const Make& make) noexcept {
  return with_handle(handle, [&](auto& object) {
    if (!good(into)) return not_to_be_filled<Into>();
    Result<decltype(into->value)> made = make(object);
    if (made.ok()) into->value = std::move(*made);
    return made.status();
  });
}

/// Bytes of three floats.
inline constexpr std::size_t kTriple = 3 * sizeof(float);

/// Stride in bytes; 0 means tightly packed. invalid_argument if the entries would overlap.
inline Status stride_of(std::size_t given, const char* name, std::size_t& stride) {
  stride = given == 0 ? kTriple : given;
  if (stride >= kTriple) return {};
  return invalid(std::string(name) + " is " + std::to_string(given) + "; it is in bytes, 12 or more, or 0");
}

/// The rotation is x, y, z, w; all zero: the identity.
inline Pose pose_of(const double (&position)[3], const double (&orientation)[4]) {
  const auto& [x, y, z, w] = orientation;
  const bool identity = x == 0 && y == 0 && z == 0 && w == 0;
  return {identity ? Quat{} : Quat{x, y, z, w}, {position[0], position[1], position[2]}};
}

/// As lw_probe_text. invalid_argument for a capacity above 0 with a null pointer.
Status copy_text(std::string_view from, char* text, std::size_t capacity, std::size_t* length);

/// Static string; empty for Validity::valid.
[[nodiscard]] const char* reason_of(Validity validity);

/// The LW_FLAG_ bits.
[[nodiscard]] std::uint32_t bits_of(Flags flags);

/// A C struct with what all answers have; the caller adds the value.
template <class Out, class T>
[[nodiscard]] Out start_answer(const Answer<T>& answer) {
  Out out{};
  out.size = sizeof out;
  out.validity = static_cast<lw_validity>(answer.validity);
  out.age_ns = answer.age.ns;
  out.reason = reason_of(answer.validity);
  out.error_bound = answer.error_bound;
  out.flags = bits_of(answer.flags);
  return out;
}

/// Length in bytes of the longest prefix of `text` that has at most `most` bytes and ends between two characters.
[[nodiscard]] std::size_t whole_characters(std::string_view text, std::size_t most);

/// A larger `size` was not set by the caller.
inline constexpr std::uint32_t kMaxStructSize = 4096;

/// Reads `size`. invalid_argument if `given` is NULL or the size is invalid; `name` is the struct's name in the header.
template <class T>
Status size_of(const T* given, const char* name, std::uint32_t& size) {
  if (given == nullptr) return invalid(std::string(name) + " is NULL");
  std::memcpy(&size, given, sizeof size);
  if (size < 2 * sizeof size || size > kMaxStructSize)
    return invalid(std::string(name) + ".size is " + std::to_string(size) + "; set it to sizeof(" + name +
                   ") before the call");
  return {};
}

/// Reads a struct. Fields that a shorter struct lacks keep their values in `into`; the unknown part of a longer one
/// must be zero.
template <class T>
Status read_sized(const T* given, const char* name, T& into) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::uint32_t size = 0;
  if (Status status = size_of(given, name, size); !status.ok()) return status;
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = sizeof(T); i < size; ++i)
    if (bytes[i] != 0)
      return invalid(std::string(name) + ": this library knows its first " + std::to_string(sizeof(T)) + " bytes of " +
                     std::to_string(size) + ", and the rest is not zero; is an older liblightwell loaded than the " +
                     "application was compiled with?");
  std::memcpy(&into, given, std::min<std::size_t>(size, sizeof(T)));
  into.size = sizeof(T);
  return {};
}

/// Writes a struct up to the caller's size; fields unknown to the library become zero. `size` is kept.
template <class T>
Status write_sized(const T& from, const char* name, T* to) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::uint32_t size = 0;
  if (Status status = size_of(to, name, size); !status.ok()) return status;
  constexpr std::size_t kHead = sizeof size;
  auto* bytes = reinterpret_cast<unsigned char*>(to);
  const std::size_t known = std::min<std::size_t>(size, sizeof(T));
  std::memcpy(bytes + kHead, reinterpret_cast<const unsigned char*>(&from) + kHead, known - kHead);
  std::memset(bytes + known, 0, size - known);
  return {};
}

/// After a failed call, fills the output with an invalid answer, so that a caller who ignores the status finds no
/// light.
template <class T>
lw_status write_failure(lw_status status, const char* name, T* out) {
  if (status == LW_OK || out == nullptr) return status;
  T none{};
  none.validity = LW_INVALID_QUERY;
  if constexpr (requires { none.reason; }) none.reason = "the call failed: lw_last_error says why";
  // The status of the call is returned, even if `out` itself is invalid.
  (void)write_sized(none, name, out);
  return status;
}

}  // namespace lightwell::c
