#include "camera/uri_parameters.hpp"

#include <algorithm>
#include <array>

#include "imaging/frame.hpp"

namespace lightwell {
namespace {

static_assert(CaptureSettings::kMaxExposures == kMaxBracket);

/// A parameter of CaptureSettings.
struct CaptureParameter {
  std::string_view name;
  std::string_view field;  ///< Of CameraConfig in config.proto.
  bool (*is_set)(const CaptureSettings&);
};

constexpr std::array kCaptureParameters = {
    CaptureParameter{"exposure", "exposure_s", [](const CaptureSettings& c) { return !c.exposure_s.empty(); }},
    CaptureParameter{"gain", "gain", [](const CaptureSettings& c) { return c.gain.has_value(); }},
    CaptureParameter{"white_balance", "white_balance_k",
                     [](const CaptureSettings& c) { return c.white_balance_k.has_value(); }},
    CaptureParameter{"colour_gains", "colour_gains",
                     [](const CaptureSettings& c) { return c.colour_gains.has_value(); }},
};

Result<std::array<double, 2>> parse_colour_gains(std::string_view text) {
  const std::size_t comma = std::min(text.find(','), text.size());
  const Result<double> red = uri_quantity(text.substr(0, comma), {{"", 1}});
  const Result<double> blue = uri_quantity(text.substr(std::min(comma + 1, text.size())), {{"", 1}});
  if (!red || !blue)
    return invalid_argument("'" + std::string(text) + "' is not two gains, red and blue, such as 1.8,1.5");
  return std::array<double, 2>{*red, *blue};
}

Status set_capture(CaptureSettings& capture, std::string_view name, std::string_view value) {
  if (name == "exposure") return uri_durations_s(value).assign_to(capture.exposure_s);
  if (name == "gain") return uri_quantity(value, {{"", 1}}).assign_to(capture.gain);
  if (name == "white_balance") return uri_quantity(value, {{"K", 1}, {"", 1}}).assign_to(capture.white_balance_k);
  return parse_colour_gains(value).assign_to(capture.colour_gains);
}

}  // namespace

Result<UriParameters> read_parameters(CameraUri uri, const CameraConfig& config, const ParameterNames& names) {
  UriParameters out;
  if (Status s = rename_parameters(uri, names.renamed, out.warnings); !s.ok()) return s;
  std::vector<std::string_view> known = names.own;
  known.insert(known.end(), names.capture.begin(), names.capture.end());
  if (Status s = check_parameters(uri, known); !s.ok()) return s;

  const std::string camera = uri.scheme + ": ";
  out.capture = config.capture;
  for (const CaptureParameter& parameter : kCaptureParameters) {
    const std::string name(parameter.name), field = "camera." + std::string(parameter.field);
    if (!parameter.is_set(config.capture)) continue;
    if (std::ranges::find(names.capture, name) == names.capture.end()) {
      std::string message = camera + field + ": this camera has no " + name + ": leave it out; its parameters are:";
      for (const std::string_view other : known) message += " " + std::string(other);
      return invalid_argument(message);
    }
    if (std::ranges::find(uri.parameters, name, &std::pair<std::string, std::string>::first) != uri.parameters.end())
      return invalid_argument(camera + name + " is given in the URI and in " + field + ": leave one of them out");
  }
  for (auto& [name, value] : uri.parameters)
    if (std::ranges::find(kCaptureParameters, name, &CaptureParameter::name) == kCaptureParameters.end())
      out.own.emplace_back(std::move(name), std::move(value));
    else if (const Status s = set_capture(out.capture, name, value); !s.ok())
      return invalid_argument(camera + name + ": " + s.message());
  if (const Status s = out.capture.validate(); !s.ok()) return invalid_argument(camera + s.message());
  return out;
}

}  // namespace lightwell
