#include "usb_camera/scene_renderer.hpp"

#include <algorithm>
#include <utility>

#include "imaging/uri.hpp"
#include "usb_camera/jpeg_encoder.hpp"
#include "usb_camera/white_balance.hpp"

namespace lightwell::usb_camera {

namespace {

constexpr std::size_t kLightMemory = std::size_t{256} << 20;
// Maximum number of cached sensors, one per colour temperature.
constexpr std::size_t kSensors = 8;

PixelFormat sensor_format(Encoding encoding) {
  switch (encoding) {
    case Encoding::yuyv:
      return PixelFormat::yuyv;
    case Encoding::nv12:
      return PixelFormat::nv12;
    case Encoding::mjpeg:
      return PixelFormat::rgb8;
  }
  return PixelFormat::yuyv;
}

}  // namespace

Result<std::shared_ptr<SceneRenderer>> SceneRenderer::open(const std::string& uri, int lens, int jpeg_quality,
                                                           const StreamFormat& format) {
  Result<CameraUri> parsed = parse_camera_uri(uri);
  if (!parsed) return parsed.status();
  if (parsed->scheme != "sim")
    return Status(StatusCode::invalid_argument, "'" + uri + "' is not a URI of the simulated camera, sim:SCENE?...");
  for (const auto& [name, value] : parsed->parameters) {
    if (name == "sensor" || name == "gain")
      return Status(StatusCode::invalid_argument,
                    name + "=" + value + " is not allowed, because the host sets it; leave it out");
  }
  CameraConfig config;
  config.width = format.size.width;
  config.height = format.size.height;
  config.frame_rate = format.rate;
  Result<SimOptions> options = parse_sim_options(*parsed, config);
  if (!options) return options.status();
  options->sensor = sensor_format(format.encoding);
  Result<std::unique_ptr<SimWorld>> world = make_sim_world(std::move(*options));
  if (!world) return world.status();
  if (lens < 0 || static_cast<std::size_t>(lens) >= (*world)->rig.lenses.size())
    return Status(StatusCode::invalid_argument,
                  "the rig " + (*world)->options.rig + " has no lens " + std::to_string(lens) +
                      "; number of lenses: " + std::to_string((*world)->rig.lenses.size()));
  return std::shared_ptr<SceneRenderer>(new SceneRenderer(std::move(*world), lens, jpeg_quality, format));
}

SceneRenderer::SceneRenderer(std::unique_ptr<SimWorld> world, int lens, int jpeg_quality, const StreamFormat& format)
    : world_(std::move(world)), lens_(static_cast<std::size_t>(lens)), jpeg_quality_(jpeg_quality), format_(format) {}

const LensRenderer& SceneRenderer::renderer() {
  std::call_once(built_, [this] {
    const LensParameters& lens = world_->rig.lenses[lens_];
    const RingSource source = world_->source();
    renderer_ = std::make_unique<LensRenderer>(
        LensRenderer{sim::LensRays(lens, sim::samples_for(lens, world_->scene.panorama({}))),
                     sim::Sensor(lens, source.sensor), source.timing});
  });
  return *renderer_;
}

SceneRenderer::Light SceneRenderer::light(std::uint64_t index) {
  const LensRenderer& lens = renderer();
  const std::size_t values =
      3 * static_cast<std::size_t>(lens.rays.width()) * static_cast<std::size_t>(lens.rays.height());
  std::promise<Light> promise;
  {
    std::unique_lock lock(mutex_);
    const auto known = std::find_if(lights_.begin(), lights_.end(),
                                    [&](const auto& entry) { return same_light(world_->scene, entry.first, index); });
    if (known != lights_.end()) {
      lights_.splice(lights_.begin(), lights_, known);
      const std::shared_future<Light> future = known->second;
      lock.unlock();
      return future.get();
    }
    lights_.emplace_front(index, promise.get_future().share());
    const std::size_t most = std::max<std::size_t>(2, kLightMemory / (values * sizeof(float)));
    while (lights_.size() > most) lights_.pop_back();
  }
  auto out = std::make_shared<std::vector<float>>(values);
  lens.radiance(world_->scene, index, *out);
  promise.set_value(out);
  return out;
}

std::shared_ptr<const sim::Sensor> SceneRenderer::sensor(int kelvin) {
  const std::lock_guard lock(mutex_);
  const auto known = sensors_.find(kelvin);
  if (known != sensors_.end()) return known->second;
  sim::SensorModel model = world_->source().sensor;
  model.photometry.white_balance = white_balance(kelvin);
  if (sensors_.size() >= kSensors) sensors_.clear();
  auto sensor = std::make_shared<const sim::Sensor>(world_->rig.lenses[lens_], model);
  sensors_[kelvin] = sensor;
  return sensor;
}

RigParameters SceneRenderer::calibration() const {
  RigParameters rig = world_->rig;
  rig.lenses = {rig.lenses[lens_]};
  return rig;
}

Result<std::vector<std::byte>> SceneRenderer::render(std::uint64_t picture, const SensorSettings& settings) {
  const std::uint64_t index = plan().scene_index_of_picture(picture);
  const LensRenderer& lens = renderer();
  const Light steady = light(index);
  std::span<const float> seen = *steady;
  std::vector<float> flickering;
  if (lens.timing.flicker.hz > 0) {
    flickering.resize(steady->size());
    lens.flicker(index, settings.exposure_s, *steady, flickering);
    seen = flickering;
  }
  const std::shared_ptr<const sim::Sensor> chip = sensor(settings.kelvin);
  std::vector<std::byte> out(chip->bytes());
  chip->expose(seen, {settings.exposure_s, settings.gain, picture, static_cast<int>(lens_)}, out);
  if (format_.encoding != Encoding::mjpeg) return out;
  return encode_jpeg(out, format_.size, jpeg_quality_, largest_frame(Encoding::mjpeg, format_.size));
}

}  // namespace lightwell::usb_camera
