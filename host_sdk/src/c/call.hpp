// How a function of the C ABI is called and answers.
//   call              runs it: nothing is thrown across, and the reason of a failure is kept
//   probe, lighting   what a handle stands for
//   copy_text         into the caller's memory
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

/// Keeps the message for lw_last_error(), cut between two characters where it is too long. Allocates nothing, so that
/// it can tell of memory that ran out.
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
    // Of a thread that the system would not start.
    return failed(StatusCode::resource_exhausted, e.what());
  } catch (const std::exception& e) {
    return failed(StatusCode::internal, e.what());
  } catch (...) {
    return failed(StatusCode::internal, "an exception of an unknown kind");
  }
}

/// Handles are checked before `work(probe)`, which returns a Status. The messages are literals: the good path makes no
/// string.
template <class Work>
lw_status with_probe(const lw_probe* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "this is no lw_probe of lw_probe_connect");
  return call([&] { return work(handle->value); });
}

template <class Work>
lw_status with_lighting(const lw_lighting* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "this is no lw_lighting of lw_lighting_create");
  return call([&] { return work(handle->value); });
}

/// The same for one that is filled.
template <class Work>
lw_status into_lighting(lw_lighting* handle, const Work& work) noexcept {
  if (!good(handle)) return failed(StatusCode::invalid_argument, "`into` is no lw_lighting of lw_lighting_create");
  return call([&] { return work(handle->value); });
}

/// As lw_probe_text. invalid_argument for a capacity without memory.
Status copy_text(std::string_view from, char* text, std::size_t capacity, std::size_t* length);

/// How many bytes of `text` are whole characters within the first `most`.
[[nodiscard]] std::size_t whole_characters(std::string_view text, std::size_t most);

}  // namespace lightwell::c
