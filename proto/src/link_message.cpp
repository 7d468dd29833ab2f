#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "request_message.hpp"
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

void serialize(const v1::LinkRequest& message, std::vector<std::byte>& out) {
  out.resize(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
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

Result<LinkResponse> decode_link_response(std::span<const std::byte> bytes) {
  v1::LinkResponse m;
  if (bytes.size() > kMaxLinkMessageBytes || !m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Status(StatusCode::data_loss, "not a LinkResponse");
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
