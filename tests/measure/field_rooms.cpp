#include "measure/field_rooms.hpp"

#include <algorithm>
#include <fstream>
#include <numbers>
#include <utility>

#include <nlohmann/json.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"

namespace lightwell::measure {
namespace {

using nlohmann::json;

Vec3d vector_of(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

PointTruth point_of(const json& j) {
  PointTruth out;
  out.position = vector_of(j.at("position"));
  const auto values = j.at("irradiance").get<std::vector<double>>();
  for (std::size_t i = 0; i + 2 < values.size(); i += 3)
    out.irradiance.push_back({values[i], values[i + 1], values[i + 2]});
  for (const json& lamp : j.at("lamps"))
    out.lamps.push_back({lamp.at("free").get<double>(), lamp.at("seen").get<double>(), vector_of(lamp.at("towards"))});
  return out;
}

}  // namespace

std::size_t PointTruth::strongest() const {
  return static_cast<std::size_t>(std::ranges::max_element(lamps, {}, &LampTruth::seen) - lamps.begin());
}

bool PointTruth::visible() const {
  const std::size_t main = strongest();
  const double largest = std::ranges::max(lamps, {}, &LampTruth::free).free;
  for (std::size_t k = 0; k < lamps.size(); ++k)
    if ((k == main || lamps[k].free >= 0.1 * largest) && lamps[k].seen < 0.5 * lamps[k].free) return false;
  return true;
}

std::string field_rooms_folder() { return LIGHTWELL_FIELD_ROOMS; }

Result<FieldRoom> load_field_room(const std::string& folder, const std::string& name) {
  const std::string stem = folder + "/" + name;
  std::ifstream file(stem + ".json");
  const json j = json::parse(file, nullptr, false);
  if (j.is_discarded()) return Status(StatusCode::not_found, stem + ".json cannot be read");
  FieldRoom out;
  out.stem = stem;
  out.name = name;
  out.size = vector_of(j.at("size"));
  for (const json& box : j.at("occluders"))
    out.occluders.push_back({vector_of(box.at("center")), vector_of(box.at("size"))});
  for (const json& lamp : j.at("lamps")) out.lamps.push_back(vector_of(lamp.at("center")));
  for (const json& n : j.at("normals")) out.normals.push_back(vec_cast<float>(vector_of(n)));
  for (const json& p : j.at("probes")) {
    const auto q = p.at("rotation").get<std::array<double, 4>>();
    out.probes.push_back({Quat{q[0], q[1], q[2], q[3]}.normalized(), vector_of(p.at("position"))});
  }
  for (const json& p : j.at("points")) out.points.push_back(point_of(p));
  return out;
}

Result<std::vector<Descriptor>> probe_descriptors(const FieldRoom& room) {
  constexpr PixelFormat kFormat = PixelFormat::rgb8;
  const RigParameters rig = *sim::make_rig("pair", 640, 480, kFormat);
  PanoramaOptions options;
  options.probe_id = fnv1a_32("lightwell");
  options.config.panorama.smoothing = Smoothing::none;  // The probes are places of one estimator.
  options.config.setting = Setting::exact;              // Lights that harmonics could hold as well are listed, too.
  const auto estimator = make_panorama_estimator(rig, options);
  if (!estimator) return estimator.status();
  std::vector<Descriptor> out;
  for (std::size_t k = 0; k < room.probes.size(); ++k) {
    Result<sim::Panorama> panorama = sim::load_panorama(room.stem + "_" + std::to_string(k) + ".exr");
    if (!panorama) return panorama.status();
    const sim::Scene scene(std::move(*panorama));
    Camera camera(rig, kFormat);
    const LensRadiance radiance = camera.render(scene, scene.state_at(0));
    const Shot shot = camera.expose(radiance, camera.bracket_of_three(peak_of(radiance), mean_of(radiance)), k);
    Result<Delivered> delivered = deliver(**estimator, shot);
    if (!delivered) return delivered.status();
    out.push_back(std::move(delivered->descriptor));
  }
  return out;
}

RoomGeometry geometry_of(const FieldRoom& room) {
  RoomGeometry out;
  const auto add_box = [&](Vec3d center, Vec3d size) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (int k = 0; k < 8; ++k)
      out.vertices.push_back(
          vec_cast<float>(center + Vec3d{((k & 1) != 0 ? 0.5 : -0.5) * size.x, ((k & 2) != 0 ? 0.5 : -0.5) * size.y,
                                         ((k & 4) != 0 ? 0.5 : -0.5) * size.z}));
    for (const auto& [a, b, c, d] : {std::array<std::uint32_t, 4>{0, 2, 6, 4},
                                     {1, 5, 7, 3},
                                     {0, 4, 5, 1},
                                     {2, 3, 7, 6},
                                     {0, 1, 3, 2},
                                     {4, 6, 7, 5}})
      for (const std::uint32_t i : {a, b, c, a, c, d}) out.indices.push_back(first + i);
  };
  add_box({0, room.size.y / 2, 0}, room.size);
  for (const auto& [center, size] : room.occluders) add_box(center, size);
  return out;
}

std::vector<FieldSample> samples_of(const FieldRoom& room, const std::vector<Descriptor>& descriptors) {
  constexpr double kRotationSigma = 0.05 * std::numbers::pi / 180, kTranslationSigma = 0.002;
  std::vector<FieldSample> out;
  for (std::size_t k = 0; k < descriptors.size(); ++k) {
    FieldSample sample{descriptors[k], {room.probes[k], {}}, {}, {}};
    for (std::size_t i = 0; i < 6; ++i) {
      const double sigma = i < 3 ? kRotationSigma : kTranslationSigma;
      sample.T_world_probe.covariance[i][i] = sigma * sigma;
    }
    out.push_back(std::move(sample));
  }
  return out;
}

}  // namespace lightwell::measure
