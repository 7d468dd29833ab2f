#include "estimate/marker/marker_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include <lightwell/direction_covariance.hpp>
#include <lightwell/harmonics.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/common/descriptor_header.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/marker/most_even_light.hpp"
#include "estimate/marker/table_light.hpp"

namespace lightwell {
namespace {

/// Constants of harmonics: proto/README.md.
constexpr double kY0 = 0.28209479177387814, kY1 = 0.48860251190291992;
/// Darker than so many times what rounding and noise hide, nothing is told.
constexpr double kDark = 3;
/// What is not modelled (paper that is not quite matte, lamps that are not points) is never better than this in a
/// direction, rad.
constexpr double kLeastSigma = 0.005;
/// Where so large a share of the patches is something else, what stands before the body or throws its shadow on it may
/// be before the table and the lamp as well, and what is left may be explained by a lamp that is not there.
constexpr double kHidden = 0.25;
/// Variance of a direction of which nothing is known, rad².
constexpr double kAnywhere = 1;
/// Paper that is white: what saturated patches are taken for in a lower bound.
constexpr double kWhite = 0.8;

/// Of light that only faces tell of, whose cosine hides what is finer.
constexpr int kEvenBand = 4;

float rounded(double v) { return static_cast<float>(v); }

class Marker final : public MarkerEstimator {
 public:
  Marker(const RigParameters& rig, RigTable table, const MarkerBody& body, std::unique_ptr<BodyFinder> finder,
         const MarkerOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        body_(body),
        finder_(std::move(finder)),
        options_(options),
        reader_(rig_, table_),
        sampler_(widest(table_), options.sampler),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
    for (const LensParameters& lens : rig_.lenses) models_.emplace_back(lens);
    apply_options();
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override;

  EstimatorKind kind() const override { return EstimatorKind::marker; }
  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(kind()); !s.ok()) return s;
    options_.config = config;
    apply_options();
    return {};
  }
  void set_scale(RadianceScale scale) override {
    scale_ = scale;
    before_.reset();
  }
  RadianceScale scale() const override { return scale_; }
  const MarkerReport& report() const override { return report_; }

 private:
  void apply_options() {
    finder_->set_decimation({options_.config.marker.search_decimation, options_.config.marker.decimation});
    sampler_.set_max_faces(options_.config.marker.max_faces);
  }
  /// Finds the body in one of the bracket's pictures; the lens that sees it.
  [[nodiscard]] Result<int> find(std::span<const Frame> bracket);
  void doubt_hidden();
  void add_attitude();
  void tell(Descriptor& out);
  void tell_around(Descriptor& out);
  void judge(Descriptor& out) const;

  RigParameters rig_;
  RigTable table_;
  MarkerBody body_;
  std::unique_ptr<BodyFinder> finder_;
  MarkerOptions options_;
  estimate::RowReader reader_;
  marker::MarkerSampler sampler_;
  std::vector<CameraModel> models_;
  estimate::LightTracker tracker_;
  RadianceScale scale_;
  marker::Shading shading_;
  std::optional<marker::ChosenLight> before_;
  MarkerReport report_;
  std::uint32_t calibration_id_;
};

Result<int> Marker::find(std::span<const Frame> bracket) {
  for (const Frame& frame : bracket) {
    for (const View& view : frame.views()) {
      const Result<std::optional<FoundBody>> found = finder_->find(view, frame.info);
      if (!found) return found.status();
      if (!*found) continue;
      report_.body = **found;
      return view.lens;
    }
  }
  before_.reset();
  return Status(StatusCode::not_found,
                "no tag of the body '" + body_.name + "' is in the picture, or too small, dark or blurred to be read");
}

Status Marker::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  const Result<int> seen = find(bracket);
  if (!seen) return seen.status();
  const auto lens = static_cast<std::size_t>(*seen);
  const LensParameters& parameters = rig_.lenses[lens];
  const marker::PlacedBody placed(body_, parameters, models_[lens], report_.body.probe_body.pose);
  report_.counts =
      sampler_.sample(reader_, *seen, parameters.width, parameters.height, body_, placed, scale_.factor, 3, shading_);
  marker::find_table_light(shading_);
  // A camera of one colour, or light of one: channels that are alike in every sample need no fit of their own.
  const auto grey = [](const marker::SurfaceSample& s) {
    const auto [least, most] = std::minmax({s.irradiance[0], s.irradiance[1], s.irradiance[2]});
    return most - least <= 1e-6 * most;
  };
  if (std::all_of(shading_.samples.begin(), shading_.samples.end(), grey)) shading_.channels = 1;

  marker::ChoiceOptions choice = options_.choice;
  choice.most_lamps = std::min({choice.most_lamps, options_.config.max_lights, static_cast<int>(kMaxLights)});
  report_.light = marker::choose_light(shading_, choice, before_ ? &*before_ : nullptr);
  before_ = report_.light;
  doubt_hidden();
  add_attitude();

  estimate::fill_header(bracket, {scale_.units, options_.probe_id, calibration_id_, options_.config.setting}, out);
  out.flicker = Flicker::unknown;
  out.environment.reset();
  tell(out);
  judge(out);
  return {};
}

/// What is left of a body that much lies over tells no direction.
void Marker::doubt_hidden() {
  const marker::SampleCounts& counts = report_.counts;
  if (counts.uneven + counts.covered + report_.light.left_out <= kHidden * counts.patches) return;
  report_.light.unsure = true;
  report_.light.placed = false;
  for (marker::ChosenLamp& lamp : report_.light.lamps) {
    lamp.unsure = true;
    lamp.direction_covariance[0] += kAnywhere;
    lamp.direction_covariance[2] += kAnywhere;
  }
}

/// Normals are as wrong as the body's attitude is, and so are directions.
void Marker::add_attitude() {
  const PoseCovariance& c = report_.body.probe_body.covariance;
  for (marker::ChosenLamp& lamp : report_.light.lamps) {
    const auto [uu, uv, vv] = direction_covariance(lamp.lamp.direction, c);
    lamp.direction_covariance[0] += uu + kLeastSigma * kLeastSigma;
    lamp.direction_covariance[1] += uv;
    lamp.direction_covariance[2] += vv + kLeastSigma * kLeastSigma;
  }
}

void Marker::tell(Descriptor& out) {
  marker::ChosenLight& light = report_.light;
  const marker::SampleCounts& counts = report_.counts;
  out.flags = {};
  // What shines on the side that is turned away from the lens is never seen.
  out.flags.set(Flag::unseen);
  if (counts.clipped > 0) out.flags.set(Flag::clipped);
  if (counts.cleaned > 0) out.flags.set(Flag::cleaned);
  const bool dark = !(counts.brightest > kDark * counts.hidden) || !(counts.brightest > 0);
  if (dark) out.flags.set(Flag::dark);
  if (light.unsure || report_.body.ambiguous || dark) out.flags.set(Flag::unsure);
  if (dark) {
    light = {};
    light.unsure = true;
  } else if (shading_.samples.empty()) {
    // Everything that was seen is saturated: at least this much comes from all around.
    for (double& v : light.ambient[0]) v = std::numbers::pi * counts.brightest / kWhite;
  }

  tell_around(out);
  out.lights.clear();
  for (const marker::ChosenLamp& lamp : light.lamps) {
    Light one;
    one.direction = vec_cast<float>(lamp.lamp.direction);
    const marker::Rgb& e = lamp.lamp.irradiance;
    if (!(e[0] + e[1] + e[2] > 0)) continue;
    one.irradiance = {rounded(e[0]), rounded(e[1]), rounded(e[2])};
    one.direction_covariance = {rounded(lamp.direction_covariance[0]), rounded(lamp.direction_covariance[1]),
                                rounded(lamp.direction_covariance[2])};
    out.lights.push_back(one);
  }
  tracker_.assign(out.lights, out.time.mid_exposure);
  const marker::SphereShares shares = marker::shares_of_sphere(sampler_.surfaces());
  out.coverage = rounded(shares.coverage);
  out.saturated = rounded(shares.saturated);
}

/// What comes from all around, and what is left to lamps of which nobody is sure.
void Marker::tell_around(Descriptor& out) {
  marker::ChosenLight& light = report_.light;
  out.radiance = {};
  out.radiance_step = 0;
  if (light.unsure && !light.placed) {
    // Lamps that explain the faces may be anywhere, and light what lies between the faces in as many ways.
    std::vector<Vec3d> toward;
    for (const marker::ChosenLamp& lamp : light.lamps) toward.push_back(lamp.lamp.direction);
    const auto even =
        marker::most_even_light(light.kept, options_.choice.errors, toward, std::min(options_.config.band, kEvenBand));
    if (even) {
      out.radiance = even->radiance;
      for (std::size_t k = 0; k < light.lamps.size(); ++k) light.lamps[k].lamp.irradiance = even->lamps[k];
      const auto sum = [](const marker::ChosenLamp& lamp) {
        return lamp.lamp.irradiance[0] + lamp.lamp.irradiance[1] + lamp.lamp.irradiance[2];
      };
      std::ranges::stable_sort(light.lamps, std::ranges::greater{}, sum);
      return;
    }
  }
  out.radiance.band = 1;
  // ambient[1..3] are x, y, z; band 1 is in the order y, z, x.
  constexpr std::array<std::size_t, 4> kOrder = {0, 2, 3, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    const double factor = i == 0 ? 1 / (std::numbers::pi * kY0) : 1.5 / (std::numbers::pi * kY1);
    const marker::Rgb& from = light.ambient[kOrder[i]];
    out.radiance.c[i] = {rounded(from[0] * factor), rounded(from[1] * factor), rounded(from[2] * factor)};
  }
}

void Marker::judge(Descriptor& out) const {
  // Of what is never seen no bound speaks; the parts are of the normals that were.
  out.bound = {};
  out.bound.total = std::numeric_limits<float>::infinity();
  double squares = 0, noise = 0;
  for (const marker::SurfaceSample& s : shading_.samples)
    squares += s.irradiance[1] * s.irradiance[1], noise += s.sigma[1] * s.sigma[1];
  if (!(squares > 0)) return;
  out.bound.noise = rounded(3 * std::sqrt(noise / squares));
  out.bound.sampling =
      rounded(3 * std::hypot(options_.choice.errors.surface_share, options_.choice.errors.surface_floor));
}

}  // namespace

Result<std::unique_ptr<MarkerEstimator>> make_marker_estimator(const RigParameters& rig, const MarkerBody& body,
                                                               std::unique_ptr<BodyFinder> finder,
                                                               const MarkerOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::marker); !s.ok()) return s;
  if (Status s = body.validate(); !s.ok()) return s;
  if (finder == nullptr) return Status(StatusCode::invalid_argument, "a marker needs a finder of its body");
  bool any = body.ball.has_value();
  for (const MarkerFace& face : body.faces) any = any || !face.patches.empty();
  if (!any)
    return Status(StatusCode::invalid_argument,
                  "the body '" + body.name + "' has neither patches nor a ball: nothing tells light");
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  return std::unique_ptr<MarkerEstimator>(
      std::make_unique<Marker>(rig, std::move(*table), body, std::move(finder), options));
}

}  // namespace lightwell
