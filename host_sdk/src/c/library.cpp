// C ABI functions without a handle: versions, names, the last error, the clock.
#include <algorithm>
#include <array>
#include <cstring>

#include <lightwell/probe.hpp>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

struct LastError {
  std::array<char, 1024> text{};
  std::size_t length = 0;
};
thread_local LastError last_error;

// The enums of the C ABI have the values of the C++ enums.
static_assert(LW_INVALID_ARGUMENT == static_cast<int>(StatusCode::invalid_argument) &&
              LW_NOT_FOUND == static_cast<int>(StatusCode::not_found) &&
              LW_DATA_LOSS == static_cast<int>(StatusCode::data_loss) &&
              LW_FAILED_PRECONDITION == static_cast<int>(StatusCode::failed_precondition) &&
              LW_UNAVAILABLE == static_cast<int>(StatusCode::unavailable) &&
              LW_RESOURCE_EXHAUSTED == static_cast<int>(StatusCode::resource_exhausted) &&
              LW_INTERNAL == static_cast<int>(StatusCode::internal));

}  // namespace

std::size_t whole_characters(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text.size();
  // Go back to the first byte of a character: UTF-8 continuation bytes are 10xxxxxx.
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return end;
}

lw_status failed(StatusCode code, std::string_view message) noexcept {
  LastError& error = last_error;
  error.length = whole_characters(message, error.text.size() - 1);
  std::copy_n(message.data(), error.length, error.text.data());
  error.text[error.length] = '\0';
  return static_cast<lw_status>(code);
}

Status copy_text(std::string_view from, char* text, std::size_t capacity, std::size_t* length) {
  if (text == nullptr && capacity > 0) return invalid("text is NULL, and capacity is not 0");
  if (capacity > 0) {
    const std::size_t n = whole_characters(from, capacity - 1);
    std::copy_n(from.data(), n, text);
    text[n] = '\0';
  }
  if (length != nullptr) *length = from.size();
  return {};
}

}  // namespace lightwell::c

using namespace lightwell;

extern "C" {

uint32_t lw_abi_version(void) { return LW_ABI_VERSION; }

const char* lw_version(void) { return version().data(); }

const char* lw_last_error(size_t* length) {
  if (length != nullptr) *length = c::last_error.length;
  return c::last_error.text.data();
}

// Both views are of string literals, which are zero-terminated.
const char* lw_status_name(lw_status status) {
  if (status < LW_OK || status > LW_INTERNAL) return "unknown";
  return to_string(static_cast<StatusCode>(status)).data();
}

const char* lw_validity_name(lw_validity validity) {
  if (validity < LW_VALID || validity > LW_INVALID_QUERY) return "unknown";
  return to_string(static_cast<Validity>(validity)).data();
}

int64_t lw_now_ns(void) { return monotonic_now_ns(); }

}  // extern "C"
