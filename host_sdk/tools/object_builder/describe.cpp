#include "describe.hpp"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <span>

#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/files.hpp>

#include "capture.hpp"

namespace lightwell::tool {
namespace {

using nlohmann::ordered_json;

bool exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path_of(path), error);
}

/// nullopt where there is no file.
Result<std::optional<Descriptor>> read_estimate(const std::string& path) {
  const auto text = read_named_file(path);
  if (!text.ok()) return text.status();
  if (!text->has_value()) return std::optional<Descriptor>();
  const auto bytes = descriptor_from_json(**text);
  if (!bytes.ok()) return bytes.status().in(path);
  auto descriptor = decode_descriptor(std::as_bytes(std::span(*bytes)));
  if (!descriptor.ok()) return descriptor.status().in(path);
  return std::optional<Descriptor>(std::move(*descriptor));
}

ordered_json json_of(const MarkerRig& found, const CaptureNames& names) {
  ordered_json turns = ordered_json::array(), positions = ordered_json::array();
  for (const float turn : found.rig.turns_rad) turns.push_back(static_cast<double>(turn) * 180 / std::numbers::pi);
  for (const Vec3f& p : found.rig.light_positions) positions.push_back({p.x, p.y, p.z});
  ordered_json out{{"turns_deg", std::move(turns)},
                   {"light_positions_m", std::move(positions)},
                   {"camera_distance_m", found.rig.camera_distance_m},
                   {"half_width_m", found.rig.half_width_m},
                   {"reference_irradiance", found.rig.reference_irradiance},
                   {"pictures", names.pictures},
                   {"coverage", names.coverage}};
  if (!names.ambient.empty()) out["ambient"] = names.ambient;
  return out;
}

}  // namespace

Result<Description> describe_capture(const std::string& folder, const CaptureNames& names, double focal_px) {
  for (const std::string* pattern : {&names.pictures, &names.estimates})
    if (pattern->find("{view}") == std::string::npos || pattern->find("{light}") == std::string::npos)
      return invalid_argument("\"" + *pattern + "\" must name a file for each {view} and {light}");
  const std::string description = folder + "/object.json";
  if (exists(description))
    return Status(StatusCode::failed_precondition, description + " exists: remove it to have it written anew");
  const auto picture = [&](std::size_t v, std::size_t l) { return folder + "/" + file_name(names.pictures, v, l); };
  Description out;
  while (exists(picture(out.views, 0))) {
    std::size_t lights = 0;
    while (exists(picture(out.views, lights))) ++lights;
    out.lights = std::max(out.lights, lights);
    ++out.views;
  }
  if (out.views == 0) return Status(StatusCode::not_found, picture(0, 0) + " does not exist");

  MarkerEstimates estimates(out.views);
  for (std::size_t v = 0; v < out.views; ++v)
    for (std::size_t l = 0; l < out.lights; ++l) {
      auto estimate = read_estimate(folder + "/" + file_name(names.estimates, v, l));
      if (!estimate.ok()) return estimate.status();
      ++out.photographs;
      out.without_marker += estimate->has_value() ? 0 : 1;
      estimates[v].push_back(std::move(*estimate));
    }
  const auto size = picture_size(picture(0, 0));
  if (!size.ok()) return size.status();
  auto found = rig_of(estimates, (*size)[0] / 2.0 / focal_px);
  if (!found.ok()) return found.status();
  out.marker = std::move(*found);
  if (const Status written = write_atomically(description, json_of(out.marker, names).dump(2) + "\n", FileMode::umask);
      !written.ok())
    return written;
  return out;
}

}  // namespace lightwell::tool
