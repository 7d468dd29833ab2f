#include <string>

#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "probe_requests.hpp"
#include "status_message.hpp"

namespace lightwell {
namespace {

// The numbers on the wire are those of StatusCode.
static_assert(static_cast<int>(StatusCode::invalid_argument) == v1::LINK_CODE_INVALID_ARGUMENT);
static_assert(static_cast<int>(StatusCode::not_found) == v1::LINK_CODE_NOT_FOUND);
static_assert(static_cast<int>(StatusCode::data_loss) == v1::LINK_CODE_DATA_LOSS);
static_assert(static_cast<int>(StatusCode::failed_precondition) == v1::LINK_CODE_FAILED_PRECONDITION);
static_assert(static_cast<int>(StatusCode::unavailable) == v1::LINK_CODE_UNAVAILABLE);
static_assert(static_cast<int>(StatusCode::resource_exhausted) == v1::LINK_CODE_RESOURCE_EXHAUSTED);
static_assert(static_cast<int>(StatusCode::internal) == v1::LINK_CODE_INTERNAL);

/// Longer texts are truncated.
constexpr std::size_t kMaxTextBytes = 1024;

template <class Message>
void serialize(const Message& message, std::vector<std::byte>& out) {
  out.resize(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
}

template <class Message>
bool parse(std::span<const std::byte> bytes, Message& message) {
  return bytes.size() <= kMaxLinkMessageBytes && message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

std::string truncated(std::string text) {
  if (text.size() <= kMaxTextBytes) return text;
  std::size_t end = kMaxTextBytes;
  // Truncate between characters, because protobuf strings must be UTF-8.
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  text.resize(end);
  return text;
}

/// Truncates the texts of a status so that the response keeps its size limit, whatever name a camera has.
StatusSnapshot with_short_texts(StatusSnapshot status) {
  for (std::string* text : {&status.probe_name, &status.version, &status.camera}) *text = truncated(std::move(*text));
  return status;
}

Status answer(const v1::LinkRequest& request, Commands& commands, v1::LinkResponse& response) {
  switch (request.ask_case()) {
    case v1::LinkRequest::kInfo:
      answer_info(with_short_texts(commands.status()), *response.mutable_info());
      return {};
    case v1::LinkRequest::kSetConfig: {
      Status done = answer_set_config(request.set_config().config(), commands, *response.mutable_set_config());
      if (!done.ok()) response.clear_set_config();
      return done;
    }
    case v1::LinkRequest::kReportLux: {
      const Result<double> scale = answer_report_lux(request.report_lux(), commands);
      if (scale) response.mutable_report_lux()->set_scale(*scale);
      return scale.status();
    }
    case v1::LinkRequest::kGetConfig:
      answer_get_config(commands, *response.mutable_get_config());
      return {};
    case v1::LinkRequest::ASK_NOT_SET:
      break;
  }
  return {StatusCode::invalid_argument,
          "this kind of request is not known to the probe; is its firmware older than the SDK?"};
}

}  // namespace

void encode_info_request(std::uint32_t id, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  m.mutable_info();
  serialize(m, out);
}

void encode_get_config_request(std::uint32_t id, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  m.mutable_get_config();
  serialize(m, out);
}

void encode_set_config_request(std::uint32_t id, const EstimatorUpdate& update, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  fill_set_config(update, *m.mutable_set_config());
  serialize(m, out);
}

void encode_report_lux_request(std::uint32_t id, double lux, Vec3d normal, std::vector<std::byte>& out) {
  v1::LinkRequest m;
  m.set_id(id);
  fill_report_lux(lux, normal, *m.mutable_report_lux());
  serialize(m, out);
}

Status answer_link_request(std::span<const std::byte> request, Commands& commands, std::vector<std::byte>& response) {
  response.clear();
  v1::LinkRequest link_request;
  if (!parse(request, link_request)) return {StatusCode::data_loss, "not a LinkRequest"};
  v1::LinkResponse m;
  m.set_id(link_request.id());
  const Status done = answer(link_request, commands, m);
  m.set_code(static_cast<v1::LinkCode>(done.code()));
  m.set_message(truncated(done.message()));
  serialize(m, response);
  return {};
}

Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes) {
  v1::LinkResponse m;
  if (!parse(bytes, m)) return Status(StatusCode::data_loss, "not a LinkResponse");
  LinkResponse out;
  out.id = m.id();
  if (m.code() != v1::LINK_CODE_OK) {
    // An unknown code of a later version is still an error.
    const bool known = v1::LinkCode_IsValid(m.code());
    out.status = Status(known ? static_cast<StatusCode>(m.code()) : StatusCode::internal, m.message());
    return out;
  }
  if (m.has_info()) out.info = InfoAnswer{status_of(m.info()), {static_cast<std::int64_t>(m.info().clock_now_ns())}};
  if (m.has_get_config() || m.set_config().has_now()) {
    const Result<EstimatorState> state = state_of(m.has_get_config() ? m.get_config() : m.set_config().now());
    if (state)
      out.estimator = *state;
    else
      out.status = state.status();
  }
  if (m.has_report_lux()) out.scale = m.report_lux().scale();
  return out;
}

}  // namespace lightwell
