// ProbeService's calls that a probe's Commands answer, as bytes of their messages: for a link that has calls of its
// own.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>
#include <lightwell/status.hpp>

namespace lightwell {

enum class ProbeCall : std::uint8_t { info, set_config, report_lux };

/// The response in binary form. data_loss where `request` is not the call's request; otherwise what Commands said, or
/// why they were not asked. Calls `commands` on this thread.
[[nodiscard]] Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands);

}  // namespace lightwell
