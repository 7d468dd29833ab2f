// Common parts of the functions of the C ABI.
//   call                                        runs a function: catches exceptions, stores the error message
//   with_probe, with_lighting, into_lighting    check a handle, then run a function with its object
//   copy_text                                   copies text into the caller's memory
#pragma once

#include <cstddef>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <lightwell/lightwell.h>
#include <lightwell/result.hpp>

#include "c/handle.hpp"

namespace lightwell::c {

/// Stores the message for lw_last_error(), truncated between two characters if it is too long. Allocates nothing, so
/// that it can report a lack of memory.
lw_status failed(StatusCode code, std::string_view message) noexcept;

inline Status invalid(std::string message) { return {StatusCode::invalid_argument, std::move(message)}; }

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

/// Checks the handle, then runs `work(probe)`, which returns a Status. Messages are literals, so that a successful call
/// constructs no string.
template <class Work>
lw_status with_probe(const lw_probe* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "this is not an lw_probe of lw_probe_connect");
  return call([&] { return work(handle->value); });
}

template <class Work>
lw_status with_lighting(const lw_lighting* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "this is not an lw_lighting of lw_lighting_create");
  return call([&] { return work(handle->value); });
}

/// The same for an lw_lighting that is to be filled.
template <class Work>
lw_status into_lighting(lw_lighting* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "`into` is not an lw_lighting of lw_lighting_create");
  return call([&] { return work(handle->value); });
}

/// As lw_probe_text. invalid_argument for a capacity above 0 with a null pointer.
Status copy_text(std::string_view from, char* text, std::size_t capacity, std::size_t* length);

/// Length in bytes of the longest prefix of `text` that has at most `most` bytes and ends between two characters.
[[nodiscard]] std::size_t whole_characters(std::string_view text, std::size_t most);

}  // namespace lightwell::c
