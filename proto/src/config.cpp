#include <lightwell/config.hpp>

#include <cmath>

#include "lightwell/v1/config.pb.h"
#include "message_values.hpp"
#include "text_message.hpp"

namespace lightwell {

Status EstimatorConfig::validate() const {
  if (band < 0 || band > 6)
    return {StatusCode::invalid_argument, "estimator.band is " + std::to_string(band) + "; it must be 0 to 6"};
  if (max_lights < 0 || max_lights > 64)
    return {StatusCode::invalid_argument,
            "estimator.max_lights is " + std::to_string(max_lights) + "; it must be 0 to 64"};
  if (!(light_threshold >= 1.5) || !std::isfinite(light_threshold))
    return {StatusCode::invalid_argument, "estimator.light_threshold is " + std::to_string(light_threshold) +
                                              "; it must be at least 1.5 times the mean"};
  return {};
}

Status Config::validate() const {
  const auto bad = [](const std::string& what) { return Status(StatusCode::invalid_argument, what); };
  if (probe_name.empty() || probe_name.size() > 64) return bad("probe_name must have 1 to 64 characters");
  if (camera.uri.empty()) return bad("camera.uri is missing: say where frames come from, for example \"sim:city\"");
  if (camera.width < 16 || camera.height < 16 || camera.width > 16384 || camera.height > 16384)
    return bad("camera size is " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
               "; each side must be 16 to 16384 pixels");
  if (!(camera.frame_rate >= 0) || camera.frame_rate > 1000)
    return bad("camera.frame_rate must be 0 (as fast as frames come) to 1000 per second");
  if (camera.exposure_s.size() > 8) return bad("camera.exposure_s: a bracket has at most 8 exposures");
  for (const double e : camera.exposure_s)
    if (!(e > 0) || !std::isfinite(e)) return bad("camera.exposure_s must be positive and finite, in seconds");
  if (!(camera.gain > 0) || !std::isfinite(camera.gain)) return bad("camera.gain must be positive and finite");
  return estimator.validate();
}

EstimatorConfig estimator_from(const v1::EstimatorConfig& m) {
  EstimatorConfig e;
  if (m.has_band()) e.band = static_cast<int>(m.band());
  if (m.has_max_lights()) e.max_lights = static_cast<int>(m.max_lights());
  if (m.has_light_threshold()) e.light_threshold = m.light_threshold();
  return e;
}

Result<Config> parse_config(std::string_view text, const std::string& name) {
  v1::Config m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  Config c;
  if (!m.probe_name().empty()) c.probe_name = m.probe_name();
  c.camera.uri = m.camera().uri();
  if (m.camera().width() != 0) c.camera.width = static_cast<int>(m.camera().width());
  if (m.camera().height() != 0) c.camera.height = static_cast<int>(m.camera().height());
  if (m.camera().frame_rate() != 0) c.camera.frame_rate = m.camera().frame_rate();
  c.camera.exposure_s.assign(m.camera().exposure_s().begin(), m.camera().exposure_s().end());
  if (m.camera().gain() != 0) c.camera.gain = m.camera().gain();
  c.calibration = m.calibration();
  c.estimator = estimator_from(m.estimator());
  if (!m.grpc().listen().empty()) c.grpc_listen = m.grpc().listen();
  c.record_path = m.record().path();
  if (const Status s = c.validate(); !s.ok()) return Status(s.code(), name + ": " + s.message());
  return c;
}

Result<Config> load_config(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_config(*text, path);
}

}  // namespace lightwell
