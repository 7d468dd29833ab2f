#include "tools/lightwell_eval/measure.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "tools/lightwell_eval/instructions.hpp"

namespace lightwell::eval {
namespace {

constexpr std::size_t kBuffers = 32;
/// Below this ratio of peak to mean luminance, a scene has no dominant light direction.
constexpr double kMinPeakToMean = 100;
/// After this time, s, a slow case gets no further passes beyond two.
constexpr double kMaxSeconds = 2;
/// Frame numbers from the start of one pass to that of the next: half a minute of simulated time.
constexpr std::uint64_t kPassStride = 1000;

Result<std::unique_ptr<Estimator>> estimator_of(const Case& c, const RigParameters& rig) {
  PanoramaOptions options;
  options.config = c.config;
  options.block_edge = c.block_edge;
  return make_panorama_estimator(rig, options);
}

/// CPU time of this thread, which excludes the time taken by other programs.
double seconds_now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Time per buffer: the minimum over the passes, averaged over the buffers.
class BestOf {
 public:
  void pass(const std::function<void(std::size_t)>& work) {
    for (std::size_t i = 0; i < kBuffers; ++i) {
      const double start = seconds_now();
      work(i);
      best_[i] = std::min(best_[i], seconds_now() - start);
    }
  }
  [[nodiscard]] double mean() const { return std::accumulate(best_.begin(), best_.end(), 0.0) / kBuffers; }

 private:
  std::vector<double> best_ = std::vector<double>(kBuffers, std::numeric_limits<double>::infinity());
};

void find_errors(const Descriptor& d, const GroundTruth& truth, const BallPictures& balls, Outcome& out) {
  double difference = 0, whole = 0, largest = 0;
  for (std::size_t k = 0; k < truth_normals().size(); ++k) {
    const Irradiance e = irradiance_at(d, vec_cast<float>(truth_normals()[k]));
    for (int c = 0; c < 3; ++c) {
      const double t = truth.irradiances()[k][static_cast<std::size_t>(c)], error = e[c] - t;
      difference += error * error;
      whole += t * t;
      largest = std::max(largest, std::abs(error));
    }
  }
  out.rms = std::sqrt(difference / whole);
  out.largest = largest / std::sqrt(whole / (3.0 * static_cast<double>(truth_normals().size())));
  if (truth.peak_to_mean() >= kMinPeakToMean) {
    out.light_deg = 180;
    for (const Light& light : d.lights) {
      const Vec3d l = vec_cast<double>(light.direction), b = truth.brightest();
      out.light_deg = std::min(*out.light_deg, angle_between(l, b) * 180 / std::numbers::pi);
    }
  }
  out.balls = ball_errors(balls, ball_pictures(d));
  out.bound = static_cast<double>(d.bound.total);
  out.map = d.environment && d.environment->whole();
}

}  // namespace

Result<Outcome> Bench::measure(const Case& c, const GroundTruth& truth, const BallPictures& balls,
                               const CameraRenderer& camera) {
  Outcome out;
  const Result<RenderedBracket> timed = camera.eight_bit(c.exposures);
  if (!timed) return timed.status();
  if (Status s = time(c, *timed, out); !s.ok()) return s;
  const Result<RenderedBracket> evaluated = c.sensor == Sensor::ideal ? camera.ideal() : timed;
  if (!evaluated) return evaluated.status();
  const Result<std::unique_ptr<Estimator>> estimator = estimator_of(c, evaluated->rig);
  if (!estimator) return estimator.status();
  Descriptor made;
  if (Status s = (*estimator)->estimate(evaluated->frames(evaluated->bytes, 0), made); !s.ok()) return s;
  Encoder encoder;
  const Result<std::span<const std::byte>> bytes = encoder.encode(made);
  if (!bytes) return bytes.status();
  // The errors are those of the decoded descriptor, including rounding by the encoding.
  const Result<Descriptor> received = decode_descriptor(*bytes);
  if (!received) return received.status();
  out.bytes = static_cast<double>(bytes->size());
  find_errors(*received, truth, balls, out);
  return out;
}

Status Bench::time(const Case& c, const RenderedBracket& bracket, Outcome& out) {
  Result<std::unique_ptr<Estimator>> estimator = estimator_of(c, bracket.rig);
  if (!estimator) return estimator.status();
  buffers_.resize(kBuffers);
  std::vector<std::vector<Frame>> frames;
  for (std::size_t i = 0; i < kBuffers; ++i) {
    buffers_[i] = bracket.bytes;
    frames.push_back(bracket.frames(buffers_[i], i));
  }
  Encoder encoder;
  Descriptor made;
  Status status;
  // Each pass begins long after the one before, so that work at a lower rate (maps) is due in the same buffers of every
  // pass. Otherwise the minimum over the passes would exclude it.
  std::uint64_t number = 0;
  const auto one = [&](std::size_t i) {
    number = i == 0 ? (number / kPassStride + 1) * kPassStride : number + 1;
    for (Frame& frame : frames[i]) {
      frame.info.mid_exposure = {static_cast<std::int64_t>(number) * 33'000'000 + frame.info.bracket_index * 1'000'000};
      frame.info.delivered = frame.info.mid_exposure;
    }
    Status s = (*estimator)->estimate(frames[i], made);
    if (s.ok()) s = encoder.encode(made).status();
    if (!s.ok()) status = s;
  };
  BestOf estimates;
  const double start = seconds_now();
  for (int i = 0; i < passes_ && (i < 2 || seconds_now() - start < kMaxSeconds); ++i) estimates.pass(one);
  out.seconds = estimates.mean();
  double pixels = 0;
  for (const LensParameters& lens : bracket.rig.lenses)
    pixels += static_cast<double>(lens.width) * lens.height * static_cast<double>(bracket.exposures.size());
  if (const auto count = count_instructions([&] {
        for (std::size_t i = 0; i < kBuffers; ++i) one(i);
      }))
    out.instructions_per_pixel = static_cast<double>(*count) / kBuffers / pixels;
  out.picture_bytes = static_cast<double>(bracket.bytes.size());
  if (!status.ok()) return status;

  frames.clear();
  double& best =
      memcpy_seconds_.try_emplace(bracket.bytes.size(), std::numeric_limits<double>::infinity()).first->second;
  BestOf copies;
  for (int i = 0; i < passes_; ++i)
    copies.pass([&](std::size_t b) {
      std::memcpy(buffers_[(b + 1) % kBuffers].data(), buffers_[b].data(), bracket.bytes.size());
    });
  best = std::min(best, copies.mean());
  return {};
}

}  // namespace lightwell::eval
