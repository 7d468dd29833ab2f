#include "usb_camera/scene_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace lightwell::usb_camera {
namespace {

// Each renderer holds two copies of a panorama and, after its first image, the directions of all its pixels.
constexpr std::size_t kMaxRenderers = 4;
// Limit of queued jobs; jobs become obsolete when settings change or the stream ends.
constexpr std::size_t kMaxJobs = 256;

}  // namespace

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
