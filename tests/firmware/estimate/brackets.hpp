// Brackets of scenes that may change between exposures, through the simulated sensor.
#pragma once

#include <random>
#include <span>
#include <vector>

#include "scenes.hpp"
#include "sim/sensor.hpp"

namespace lightwell::testing_scenes {

struct Bracket {
  std::vector<std::vector<std::byte>> pixels;
  std::vector<Frame> frames;
};

/// Radiance of every pixel of a lens, r g b.
inline std::vector<float> radiance_of(const LensTable& lens, const RadianceOf& scene) {
  std::vector<float> out(3 * lens.direction.size());
  for (std::size_t i = 0; i < lens.direction.size(); ++i) {
    if (!(lens.solid_angle[i] > 0)) continue;
    const Radiance l = scene(vec_cast<double>(lens.direction[i]));
    out[3 * i] = l.r, out[3 * i + 1] = l.g, out[3 * i + 2] = l.b;
  }
  return out;
}

/// `scenes` has one element per exposure. `number` determines the noise.
inline Bracket bracket_of(const RigParameters& rig, const RigTable& table, PixelFormat format,
                          std::span<const RadianceOf> scenes, std::span<const double> exposures,
                          std::uint64_t number = 0) {
  Bracket out;
  const sim::SensorModel model = sim::sensor_of(rig, format, 7);
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame frame;
    frame.info.exposure_s = exposures[e];
    frame.info.sequence = number * exposures.size() + e;
    frame.info.mid_exposure = {static_cast<std::int64_t>((number + 1) * 33'000'000)};
    for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
      const sim::Sensor sensor(rig.lenses[k], model);
      std::vector<std::byte> pixels(sensor.bytes());
      sensor.expose(radiance_of(table.lenses[k], scenes[e]),
                    {exposures[e], 1, number * exposures.size() + e, static_cast<int>(k)}, pixels);
      out.pixels.push_back(std::move(pixels));
      frame.add_view(
          {static_cast<int>(k), format, rig.lenses[k].width, rig.lenses[k].height, sensor.stride(), out.pixels.back()});
    }
    out.frames.push_back(std::move(frame));
  }
  return out;
}

/// A room with walls, fine structure and a lamp: radiance from 0.3 to `lamp_radiance`.
inline RadianceOf furnished_room(Vec3d lamp_at = {0.3, 0.8, -0.5}, float lamp_radiance = 400) {
  const Vec3d axis = normalized(lamp_at);
  return [=](Vec3d d) {
    Radiance l{1, 1, 1};
    if (d.x < -0.7) l = {2, 0.6F, 0.5F};
    if (d.x > 0.7) l = {0.5F, 1.5F, 0.6F};
    if (d.y < -0.6) l = {0.4F, 0.35F, 0.3F};
    const auto stripes = static_cast<float>(1 + 0.5 * std::sin(40 * d.x) * std::sin(31 * d.y + 17 * d.z));
    l = l * stripes;
    if (dot(d, axis) > std::cos(0.05)) l = l + Radiance{lamp_radiance, 0.9F * lamp_radiance, 0.7F * lamp_radiance};
    return l;
  };
}

}  // namespace lightwell::testing_scenes
