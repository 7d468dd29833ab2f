#include "camera/backends/sim/frame_ring.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>

namespace lightwell {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRenderThreads = 2;
constexpr std::uint64_t kStillBrackets = 4;

std::uint64_t rounded_up(std::uint64_t n, std::uint64_t step) { return (n + step - 1) / step * step; }

/// The number of frames from `least` to twice as many, in steps of `step`, that contains most nearly a whole number of
/// periods: smallest relative change of the frequency that would make it exact.
std::uint64_t closing_cycle(std::uint64_t least, std::uint64_t step, double periods_per_frame) {
  std::uint64_t best = least;
  double smallest = 1;
  for (std::uint64_t n = least; n <= 2 * least; n += step) {
    const double periods = periods_per_frame * static_cast<double>(n);
    const double off = std::abs(periods - std::round(periods)) / periods;
    if (off >= smallest * (1 - 1e-6) || smallest < 1e-9) continue;
    smallest = off;
    best = n;
  }
  return best;
}

Status too_large(const RingRequest& request) {
  return {StatusCode::resource_exhausted, "sim: one bracket of frames takes " +
                                              std::to_string((request.bracket * request.bytes_per_picture) >> 20) +
                                              " MiB, more than the " + std::to_string(request.memory_cap >> 20) +
                                              " MiB that the simulator allows itself: use a smaller picture"};
}

/// Reports the progress of rendering, once that has taken two seconds.
class ProgressReporter {
 public:
  ProgressReporter(const RenderProgress& progress, std::uint64_t total) : progress_(progress), total_(total) {}

  void one_done() {
    const std::lock_guard lock(mutex_);
    ++done_;
    const auto now = Clock::now();
    if (!progress_ || now < next_) return;
    next_ = now + std::chrono::milliseconds(500);
    progress_(static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const RenderProgress& progress_;
  const std::uint64_t total_;
  std::mutex mutex_;
  std::uint64_t done_ = 0;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(2);
};

}  // namespace

void LensRenderer::radiance(const sim::Scene& scene, std::uint64_t index, std::span<float> out) const {
  if (timing.readout_s == 0 || scene.motion().turn_rad_per_s == 0) {
    rays.render(scene, scene.state_at(index), {0, rays.height()}, out);
    return;
  }
  // Rolling shutter: each row has its own time; the centre row has the frame's.
  for (int j = 0; j < rays.height(); ++j) {
    const double offset_s = (j - (rays.height() - 1) / 2.0) * timing.readout_s;
    rays.render(scene, scene.state_at(index, offset_s), {j, j + 1}, out);
  }
}

void LensRenderer::flicker(std::uint64_t index, double exposure_s, std::span<const float> steady,
                           std::span<float> out) const {
  const double exposed_s = timing.takes_time ? exposure_s : 0;
  const double middle_s = static_cast<double>(index) / timing.frame_rate - exposed_s / 2;
  const auto width = 3 * static_cast<std::size_t>(rays.width());
  for (int j = 0; j < rays.height(); ++j) {
    const double row_s = middle_s + (j - (rays.height() - 1) / 2.0) * timing.readout_s;
    const auto factor = static_cast<float>(timing.flicker.factor(row_s, exposed_s));
    const std::size_t begin = static_cast<std::size_t>(j) * width;
    for (std::size_t k = begin; k < begin + width; ++k) out[k] = steady[k] * factor;
  }
}

bool same_light(const sim::Scene& scene, std::uint64_t index, std::uint64_t other) {
  if (index == other) return true;
  return scene.motion().turn_rad_per_s == 0 && scene.state_at(index).lamp_factor == scene.state_at(other).lamp_factor;
}

std::uint64_t RingPlan::pictures() const {
  if (realisations == 0) return cycle;
  return switch_period > 0 ? 2 * realisations : realisations;
}

std::uint64_t RingPlan::picture(std::uint64_t sequence) const {
  if (realisations == 0) return sequence % cycle;
  const std::uint64_t state = switch_period > 0 ? scene_index(sequence) / switch_period % 2 : 0;
  return state * realisations + sequence % realisations;
}

std::uint64_t RingPlan::scene_index_of_picture(std::uint64_t picture) const {
  return realisations == 0 ? picture : picture / realisations * switch_period;
}

Result<RingPlan> plan_moving(const RingRequest& request) {
  RingPlan plan;
  plan.bracket = request.bracket;
  plan.switch_period = request.switch_period;
  const std::uint64_t step =
      request.switch_period > 0 ? std::lcm(request.bracket, 2 * request.switch_period) : request.bracket;
  plan.wanted = rounded_up(std::max<std::uint64_t>(request.frames, 1), step);
  const std::uint64_t room = request.memory_cap / std::max<std::size_t>(request.bytes_per_picture, 1);
  if (request.periods_per_frame > 0) plan.wanted = closing_cycle(plan.wanted, step, request.periods_per_frame);
  plan.cycle = plan.wanted;
  if (plan.wanted > room) {
    plan.cycle = room / request.bracket * request.bracket;
    if (plan.cycle == 0) return too_large(request);
    if (plan.switch_period > 0) plan.switch_period = std::clamp<std::uint64_t>(plan.cycle / 2, 1, plan.switch_period);
  }
  if (request.periods_per_frame > 0) {
    const auto cycle = static_cast<double>(plan.cycle);
    plan.periods_per_frame = std::max(1.0, std::round(request.periods_per_frame * cycle)) / cycle;
  }
  return plan;
}

Result<RingPlan> plan_still(const RingRequest& request) {
  RingPlan plan;
  plan.bracket = request.bracket;
  plan.switch_period = request.switch_period;
  plan.cycle = request.switch_period > 0 ? 2 * request.switch_period : 1;
  plan.realisations = kStillBrackets * request.bracket;
  plan.wanted = plan.pictures();
  while (plan.pictures() * request.bytes_per_picture > request.memory_cap) {
    if (plan.realisations == request.bracket) return too_large(request);
    plan.realisations -= request.bracket;
  }
  return plan;
}

void FrameRing::render(const RingPlan& plan, const RingSource& source, const RenderProgress& progress) {
  plan_ = plan;
  std::vector<LensRenderer> lenses;
  lens_start_ = {0};
  for (const LensParameters& lens : source.rig->lenses) {
    const int samples = sim::samples_for(lens, source.scene->panorama({}));
    lenses.push_back({sim::LensRays(lens, samples), sim::Sensor(lens, source.sensor), source.timing});
    lens_start_.push_back(lens_start_.back() + lenses.back().sensor.bytes());
  }
  memory_.assign(lens_start_.back() * plan.pictures(), std::byte{0});

  std::atomic<std::uint64_t> next{0};
  ProgressReporter reporter(progress, plan.pictures());
  const auto work = [&] {
    std::vector<std::vector<float>> radiance(lenses.size());
    std::vector<float> flickering;
    // Successive pictures of a static scene have the same state: render the radiance once.
    std::uint64_t rendered = ~std::uint64_t{0};
    for (std::uint64_t p = next++; p < plan.pictures(); p = next++) {
      const std::uint64_t index = plan.scene_index_of_picture(p);
      const bool same = rendered != ~std::uint64_t{0} && same_light(*source.scene, index, rendered);
      for (std::size_t l = 0; l < lenses.size(); ++l) {
        const sim::LensRays& rays = lenses[l].rays;
        if (!same) {
          radiance[l].resize(3 * static_cast<std::size_t>(rays.width()) * static_cast<std::size_t>(rays.height()));
          lenses[l].radiance(*source.scene, index, radiance[l]);
        }
        std::span<const float> light = radiance[l];
        if (source.timing.flicker.hz > 0) {
          flickering.resize(light.size());
          lenses[l].flicker(index, source.exposure_s[p % plan.bracket], light, flickering);
          light = flickering;
        }
        const sim::Exposure exposure{source.exposure_s[p % plan.bracket], source.gain, p, static_cast<int>(l)};
        lenses[l].sensor.expose(
            light, exposure,
            std::span(memory_).subspan(p * lens_start_.back() + lens_start_[l], lenses[l].sensor.bytes()));
      }
      rendered = index;
      reporter.one_done();
    }
  };
  std::vector<std::thread> helpers;
  for (int i = 1; i < kRenderThreads; ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
}

std::span<const std::byte> FrameRing::view(std::uint64_t picture, std::size_t lens) const {
  return std::span(memory_).subspan(picture * lens_start_.back() + lens_start_[lens],
                                    lens_start_[lens + 1] - lens_start_[lens]);
}

}  // namespace lightwell
