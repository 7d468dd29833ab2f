// Execution of a client's requests by a probe's Commands, from bytes to bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/commands.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

enum class ProbeCall : std::uint8_t { info, set_config, report_lux, get_config };

/// For a link with its own RPC: the response in binary form. data_loss if `request` is not a request of this call;
/// otherwise the error of `commands`, or why they were not called. Calls `commands` on this thread.
[[nodiscard]] Result<std::string> answer_probe_call(ProbeCall call, std::string_view request, Commands& commands);

/// For a link without (USB): executes a LinkRequest and writes the LinkResponse, at most kMaxLinkMessageBytes, into
/// `response`. Every LinkRequest has a response, also one that is refused. data_loss if `request` is not a LinkRequest;
/// `response` is then empty. Calls `commands` on this thread.
[[nodiscard]] Status answer_link_request(std::span<const std::byte> request, Commands& commands,
                                         std::vector<std::byte>& response);

}  // namespace lightwell
