#include "configuration.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string_view>

namespace lightwell::xr {
namespace {

constexpr const char* kProbe = "LIGHTWELL_XR_PROBE";
constexpr const char* kCredentials = "LIGHTWELL_XR_CREDENTIALS";
constexpr const char* kSpace = "LIGHTWELL_XR_SPACE";
constexpr const char* kPose = "LIGHTWELL_XR_POSE";
constexpr const char* kScale = "LIGHTWELL_XR_SCALE";

std::string_view variable(const char* name) {
  const char* const text = ::secure_getenv(name);
  return text == nullptr ? std::string_view{} : text;
}

/// The numbers of "a,b,c": exactly N, all finite.
template <std::size_t N>
std::optional<std::array<double, N>> numbers(std::string_view text) {
  std::array<double, N> out{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [rest, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc{} || !std::isfinite(out[i])) return std::nullopt;
    at = rest;
  }
  if (at != end) return std::nullopt;
  return out;
}

std::string refused(const char* name, std::string_view value, const char* allowed) {
  return std::string(name) + "=" + std::string(value.substr(0, 100)) + ": " + allowed;
}

std::optional<Pose> pose_of(std::string_view text) {
  const auto v = numbers<7>(text);
  if (!v) return std::nullopt;
  const auto& [x, y, z, qx, qy, qz, qw] = *v;
  // A quaternion of another length is a mistake in the seven numbers, such as a wrong order.
  const double length = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
  if (!(std::abs(length - 1) < 0.01)) return std::nullopt;
  return Pose{Quat{qx, qy, qz, qw}.normalized(), {x, y, z}};
}

}  // namespace

Configuration read_configuration() {
  Configuration out;
  out.uri = variable(kProbe);
  if (out.uri.empty()) {
    out.error = std::string(kProbe) + " is not set: set it to the address of a probe, such as grpc://probe.local:7420";
    return out;
  }
  out.credentials = variable(kCredentials);
  if (const std::string_view text = variable(kSpace); text == "stage")
    out.space = XR_REFERENCE_SPACE_TYPE_STAGE;
  else if (text == "view")
    out.space = XR_REFERENCE_SPACE_TYPE_VIEW;
  else if (!text.empty() && text != "local")
    out.error = refused(kSpace, text, "it is local, stage or view");
  if (const std::string_view text = variable(kPose); !text.empty()) {
    out.T_space_probe = pose_of(text);
    if (!out.T_space_probe)
      out.error = refused(kPose, text, "it is x,y,z,qx,qy,qz,qw: metres, and a quaternion of length 1");
  }
  if (const std::string_view text = variable(kScale); !text.empty()) {
    const auto scale = numbers<1>(text);
    if (scale && (*scale)[0] >= 1e-9 && (*scale)[0] <= 1e9)
      out.scale = static_cast<float>((*scale)[0]);
    else
      out.error = refused(kScale, text, "it is a number from 1e-9 to 1e9");
  }
  return out;
}

}  // namespace lightwell::xr
