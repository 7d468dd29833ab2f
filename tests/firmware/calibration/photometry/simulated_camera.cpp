#include "firmware/calibration/photometry/simulated_camera.hpp"

#include <cmath>

#include "sim/sensor.hpp"

namespace lightwell::photometry {
namespace {

sim::Sensor sensor_of(PixelFormat format, const PhotometricCalibration& photometry, std::uint64_t seed) {
  sim::SensorModel model;
  model.format = format;
  model.photometry = photometry;
  model.seed = seed;
  const RigParameters rig = *sim::make_rig("equirect", SimulatedCamera::kWidth, SimulatedCamera::kHeight, format);
  return {rig.lenses.front(), model};
}

}  // namespace

SimulatedCamera::SimulatedCamera(PixelFormat format, const PhotometricCalibration& photometry, std::uint64_t seed)
    : format_(format), sensor_(sensor_of(format, photometry, seed)) {}

Picture SimulatedCamera::shoot(const Scene& scene, double exposure_s, double gain) {
  std::vector<float> radiance;
  radiance.reserve(3UL * kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) radiance.insert(radiance.end(), 3, static_cast<float>(scene(x, y)));
  std::vector<std::byte> bytes(sensor_.bytes());
  sensor_.expose(radiance, {exposure_s, gain, frame_++, 0}, bytes);
  return *picture_of({0, format_, kWidth, kHeight, sensor_.stride(), bytes}, "simulated");
}

std::vector<Picture> SimulatedCamera::darks(int count, double gain) {
  std::vector<Picture> out;
  for (int i = 0; i < count; ++i) out.push_back(shoot([](int, int) { return 0.0; }, 0.01, gain));
  return out;
}

std::vector<FlatPair> SimulatedCamera::flats(const std::vector<double>& levels, double gain) {
  std::vector<FlatPair> out;
  for (const double level : levels) {
    const Scene even = [&](int, int) { return level / gain; };
    Picture first = shoot(even, 1, gain), second = shoot(even, 1, gain);
    out.push_back({std::move(first), std::move(second), gain});
  }
  return out;
}

PhotometricCalibration usual_photometry(PixelFormat format) {
  return sim::make_rig("equirect", SimulatedCamera::kWidth, SimulatedCamera::kHeight, format)
      ->lenses.front()
      .photometry;
}

double shades(int x, int y) {
  const unsigned square = static_cast<unsigned>(x / 6) * 2654435761U ^ static_cast<unsigned>(y / 6) * 2246822519U;
  const double share = static_cast<double>((square * 2654435761U) >> 8) / 16777216.0;
  return std::pow(1000.0, share);
}

double toe_and_shoulder(double value) {
  const double v = value;
  return 0.25 * v + 1.5 * v * v - 1.6 * v * v * v + 0.85 * v * v * v * v * v;
}

}  // namespace lightwell::photometry
