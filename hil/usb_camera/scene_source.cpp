#include "usb_camera/scene_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "imaging/jpeg_encoder.hpp"
#include "imaging/uri.hpp"

namespace lightwell::usb_camera {
namespace {

// Each renderer holds two copies of a panorama and, after its first image, the directions of all its pixels.
constexpr std::size_t kMaxRenderers = 4;
// Limit of queued jobs; jobs become obsolete when settings change or the stream ends.
constexpr std::size_t kMaxJobs = 256;
constexpr std::size_t kLightMemory = std::size_t{256} << 20;
// Maximum number of cached sensors, one per colour temperature.
constexpr std::size_t kSensors = 8;

/// The sensor's formats in the order of Encoding.
constexpr std::array kSensorFormats = {PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::rgb8};

double cubic(double t, double a, double b, double c, double d) { return ((a * t + b) * t + c) * t + d; }

/// Linear Rec. 709 of the black body with Y = 1.
std::array<double, 3> planckian_rgb(double kelvin) {
  const double t = 1000 / kelvin;
  const double x = kelvin <= 4000 ? cubic(t, -0.2661239, -0.2343589, 0.8776956, 0.179910)
                                  : cubic(t, -3.0258469, 2.1070379, 0.2226347, 0.240390);
  const double y = kelvin <= 2222   ? cubic(x, -1.1063814, -1.34811020, 2.18555832, -0.20219683)
                   : kelvin <= 4000 ? cubic(x, -0.9549476, -1.37418593, 2.09137015, -0.16748867)
                                    : cubic(x, 3.0817580, -5.87338670, 3.75112997, -0.37001483);
  const double big_x = x / y, big_z = (1 - x - y) / y;
  // IEC 61966-2-1, annex F: XYZ to linear sRGB.
  return {3.2406 * big_x - 1.5372 - 0.4986 * big_z, -0.9689 * big_x + 1.8758 + 0.0415 * big_z,
          0.0557 * big_x - 0.2040 + 1.0570 * big_z};
}

}  // namespace

std::array<double, 3> white_balance(double kelvin) {
  const std::array<double, 3> seen = planckian_rgb(kelvin), neutral = planckian_rgb(kNeutralKelvin);
  const double green = seen[1] / neutral[1];
  return {seen[0] / neutral[0] / green, 1.0, seen[2] / neutral[2] / green};
}

Result<std::vector<std::byte>> encode_mjpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                            std::size_t max_bytes) {
  for (;; quality -= 5) {
    Result<std::vector<std::byte>> jpeg =
        encode_jpeg(rgb, size.width, size.height, {.quality = quality, .chroma = ChromaSampling::yuv422});
    if (!jpeg || jpeg->size() <= max_bytes) return jpeg;
    if (quality <= 5)
      return Status(StatusCode::internal,
                    "JPEG: the image exceeds " + std::to_string(max_bytes) + " bytes even at the lowest quality");
  }
}

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
  options->sensor = kSensorFormats[static_cast<std::size_t>(format.encoding)];
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
  return encode_mjpeg(out, format_.size, jpeg_quality_, largest_frame(Encoding::mjpeg, format_.size));
}

Result<std::unique_ptr<SceneSource>> SceneSource::open(SceneOptions options, std::function<void()> ready) {
  // The format that determines automatic exposure until a host has chosen one.
  Result<std::shared_ptr<SceneRenderer>> renderer =
      SceneRenderer::open(options.uri, options.lens, options.jpeg_quality, {Encoding::yuyv, {640, 480}, 30});
  if (!renderer) return renderer.status();
  return std::unique_ptr<SceneSource>(new SceneSource(std::move(options), std::move(ready), 0, std::move(*renderer)));
}

SceneSource::SceneSource(SceneOptions options, std::function<void()> ready, std::uint64_t serial,
                         std::shared_ptr<SceneRenderer> renderer)
    : options_(std::move(options)), ready_(std::move(ready)) {
  renderers_.emplace_front(serial, std::move(renderer));
  for (int i = 0; i < std::max(1, options_.threads); ++i) threads_.emplace_back([this] { work(); });
}

SceneSource::~SceneSource() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

Status SceneSource::set_scene(const std::string& uri) {
  Result<std::shared_ptr<SceneRenderer>> renderer =
      SceneRenderer::open(uri, options_.lens, options_.jpeg_quality, renderers_.front().second->format());
  if (!renderer) return renderer.status();
  options_.uri = uri;
  renderers_.clear();
  renderers_.emplace_front(next_renderer_++, std::move(*renderer));
  const std::lock_guard lock(mutex_);
  jobs_.clear();
  pending_.clear();
  kept_.clear();
  counts_.kept = counts_.kept_bytes = 0;
  return {};
}

Status SceneSource::configure(const StreamFormat& format) {
  const auto known = std::find_if(renderers_.begin(), renderers_.end(),
                                  [&](const auto& entry) { return entry.second->format() == format; });
  if (known != renderers_.end()) {
    std::rotate(renderers_.begin(), known, known + 1);
    return {};
  }
  Result<std::shared_ptr<SceneRenderer>> renderer =
      SceneRenderer::open(options_.uri, options_.lens, options_.jpeg_quality, format);
  if (!renderer) return renderer.status();
  renderers_.emplace_front(next_renderer_++, std::move(*renderer));
  if (renderers_.size() > kMaxRenderers) renderers_.pop_back();
  return {};
}

double SceneSource::readout_s() const {
  const SceneRenderer& renderer = *renderers_.front().second;
  return renderer.readout_s() * renderer.format().size.height;
}

double SceneSource::automatic_exposure_s() const { return renderers_.front().second->exposure_s(); }

SceneSource::Job SceneSource::job(std::uint64_t number, const SensorSettings& settings) const {
  const auto& [serial, renderer] = renderers_.front();
  const std::uint64_t picture = renderer->plan().picture(number);
  return {
      {serial, picture, std::llround(settings.exposure_s * 1e9), std::llround(settings.gain * 1e3), settings.kelvin},
      renderer,
      picture,
      settings};
}

void SceneSource::enqueue(Job job, bool first) {
  // The mutex is held.
  const bool fresh = pending_.insert(job.key).second;
  if (!fresh) {
    if (!first) return;
    const auto queued = std::find_if(jobs_.begin(), jobs_.end(), [&](const Job& j) { return j.key == job.key; });
    if (queued == jobs_.end()) return;  // It is being rendered.
    jobs_.erase(queued);
  }
  if (first) {
    jobs_.push_front(std::move(job));
  } else {
    jobs_.push_back(std::move(job));
  }
  while (jobs_.size() > kMaxJobs) {
    pending_.erase(jobs_.back().key);
    jobs_.pop_back();
  }
  wake_.notify_one();
}

Picture SceneSource::picture(std::uint64_t number, const SensorSettings& settings) {
  Job wanted = job(number, settings);
  const std::lock_guard lock(mutex_);
  const auto kept = kept_.find(wanted.key);
  if (kept != kept_.end()) {
    kept->second.used = ++clock_;
    return kept->second.picture;
  }
  enqueue(std::move(wanted), true);
  return nullptr;
}

void SceneSource::order(std::uint64_t number, const SensorSettings& settings) {
  Job wanted = job(number, settings);
  const std::lock_guard lock(mutex_);
  if (!kept_.contains(wanted.key)) enqueue(std::move(wanted), false);
}

Status SceneSource::render_ahead(const StreamFormat& format, const std::vector<double>& exposure_s) {
  if (Status configured = configure(format); !configured.ok()) return configured;
  const RingPlan& plan = renderers_.front().second->plan();
  std::vector<double> exposures = exposure_s;
  if (exposures.empty()) exposures = {automatic_exposure_s()};
  // Each image of the cycle with each exposure, because a bracket may start at any frame.
  for (const double exposure : exposures) {
    for (std::uint64_t number = 0; number < std::max(plan.cycle, plan.pictures()); ++number) {
      Job wanted = job(number, {exposure, 1, kNeutralKelvin});
      std::unique_lock lock(mutex_);
      finished_.wait(lock, [&] { return jobs_.size() < kMaxJobs / 2; });
      if (!kept_.contains(wanted.key)) enqueue(std::move(wanted), false);
    }
  }
  std::unique_lock lock(mutex_);
  finished_.wait(lock, [&] { return pending_.empty(); });
  if (counts_.failed > 0) return {StatusCode::internal, "an image could not be rendered"};
  return {};
}

void SceneSource::keep(const Key& key, Picture picture) {
  // The mutex is held.
  counts_.kept_bytes += picture->size();
  kept_[key] = {std::move(picture), ++clock_};
  while (counts_.kept_bytes > options_.memory && kept_.size() > 1) {
    const auto oldest = std::min_element(kept_.begin(), kept_.end(),
                                         [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
    counts_.kept_bytes -= oldest->second.picture->size();
    kept_.erase(oldest);
  }
  counts_.kept = kept_.size();
}

void SceneSource::work() {
  using Clock = std::chrono::steady_clock;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
    if (stopping_) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    const Clock::time_point start = Clock::now();
    Result<std::vector<std::byte>> bytes = job.renderer->render(job.picture, job.settings);
    const std::chrono::duration<double> taken = Clock::now() - start;
    lock.lock();
    // A job that is no longer pending belongs to a scene that was replaced.
    const bool wanted = pending_.erase(job.key) > 0;
    counts_.render_s += taken.count();
    if (bytes) {
      ++counts_.rendered;
      if (wanted) keep(job.key, std::make_shared<const std::vector<std::byte>>(std::move(*bytes)));
    } else {
      ++counts_.failed;
    }
    finished_.notify_all();
    lock.unlock();
    if (ready_) ready_();
    lock.lock();
  }
}

RenderCounts SceneSource::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace lightwell::usb_camera
