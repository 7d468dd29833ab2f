// Measures LightField in the path-traced rooms of tests/reference/mitsuba/field, whose README defines what is measured.
// One JSON object per line.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/field.hpp>
#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "measure/field_rooms.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using measure::FieldRoom;
using measure::PointTruth;
using nlohmann::ordered_json;

constexpr double kDegrees = 180 / std::numbers::pi;

/// RMS over normals and channels of the difference, relative to the RMS of the truth.
double irradiance_error(const FieldRoom& room, const PointTruth& point, const Lighting& light) {
  double difference = 0, truth = 0;
  for (std::size_t n = 0; n < room.normals.size(); ++n) {
    const Irradiance e = light.irradiance(room.normals[n]).value;
    for (std::size_t c = 0; c < 3; ++c) {
      const double t = point.irradiance[n][c], d = static_cast<double>(e[static_cast<int>(c)]) - t;
      difference += d * d;
      truth += t * t;
    }
  }
  return std::sqrt(difference / truth);
}

double strongest_error_deg(const PointTruth& point, const Lighting& light) {
  const auto primary = light.primary_light();
  if (!primary) return 180;
  return kDegrees * angle_between(vec_cast<double>(primary->direction), point.lamps[point.strongest()].towards);
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// What the nearest probe alone says, in the world's axes.
Lighting nearest_probe(const FieldRoom& room, const std::vector<FieldSample>& samples, Vec3d position) {
  const auto nearest = std::ranges::min_element(
      samples, {}, [&](const FieldSample& s) { return length(s.T_world_probe.pose.translation - position); });
  (void)room;
  return Lighting::of(nearest->light).in_world(nearest->T_world_probe.pose);
}

struct Errors {
  std::vector<double> irradiance, direction_deg, irradiance_visible, direction_visible_deg;

  void add(bool visible, double e, double angle) {
    irradiance.push_back(e);
    direction_deg.push_back(angle);
    if (!visible) return;
    irradiance_visible.push_back(e);
    direction_visible_deg.push_back(angle);
  }
  void write(ordered_json& line) {
    line["irradiance_rms"] = rms(irradiance);
    line["irradiance_rms_visible"] = rms(irradiance_visible);
    line["irradiance_median_visible"] = median(irradiance_visible);
    line["irradiance_95_visible"] = lower_quantile(irradiance_visible, 0.95);
    line["direction_median_visible_deg"] = median(direction_visible_deg);
    line["direction_within_3_visible"] = share_within(direction_visible_deg, 3);
    line["direction_90_visible_deg"] = lower_quantile(direction_visible_deg, 0.9);
    line["direction_within_3"] = share_within(direction_deg, 3);
  }
  static double share_within(const std::vector<double>& values, double limit) {
    const auto count = std::ranges::count_if(values, [&](double v) { return v <= limit; });
    return static_cast<double>(count) / static_cast<double>(values.size());
  }
};

void measure_points(const FieldRoom& room, const std::vector<FieldSample>& samples, const LightField& field,
                    const std::string& method, bool each_point) {
  Errors ours, nearest;
  std::size_t holds = 0, finite = 0, visible = 0;
  std::vector<double> ratios;
  for (const PointTruth& point : room.points) {
    const FieldAnswer answer = field.at(point.position, {});
    const double e = irradiance_error(room, point, answer.light);
    const double bound = static_cast<double>(answer.light.descriptor().bound.total);
    const double angle = strongest_error_deg(point, answer.light);
    const bool sees = point.visible();
    ours.add(sees, e, angle);
    const Lighting single = nearest_probe(room, samples, point.position);
    nearest.add(sees, irradiance_error(room, point, single), strongest_error_deg(point, single));
    holds += e <= bound ? 1 : 0;
    visible += sees ? 1 : 0;
    finite += sees && std::isfinite(bound) ? 1 : 0;
    if (std::isfinite(bound)) ratios.push_back(bound / e);
    if (each_point)
      measure::print_line({{"room", room.name},
                           {"method", method},
                           {"position", {point.position.x, point.position.y, point.position.z}},
                           {"visible", sees},
                           {"strongest", point.strongest()},
                           {"error", e},
                           {"bound", std::isfinite(bound) ? ordered_json(bound) : ordered_json()},
                           {"direction_deg", angle},
                           {"nearest_probe_m", answer.nearest_probe_m}});
  }
  ordered_json line{{"room", room.name}, {"method", method}, {"points", room.points.size()}, {"visible", visible}};
  ours.write(line);
  line["bound_holds"] = static_cast<double>(holds) / static_cast<double>(room.points.size());
  line["bound_finite_visible"] = static_cast<double>(finite) / static_cast<double>(visible);
  line["bound_to_error_median"] = median(ratios);
  measure::print_line(line);
  if (method != "field") return;
  ordered_json single{
      {"room", room.name}, {"method", "nearest probe"}, {"points", room.points.size()}, {"visible", visible}};
  nearest.write(single);
  measure::print_line(single);
}

void measure_lamps(const FieldRoom& room, const LightField& field, const std::string& method) {
  const auto state = field.state();
  for (std::size_t k = 0; k < room.lamps.size(); ++k) {
    double nearest = std::numeric_limits<double>::infinity(), off = nearest;
    for (const Pose& probe : room.probes) nearest = std::min(nearest, length(probe.translation - room.lamps[k]));
    double sigma = 0;
    for (const FieldLight& light : state->lights) {
      if (!light.placed || length(light.position - room.lamps[k]) >= off) continue;
      off = length(light.position - room.lamps[k]);
      sigma = std::sqrt(light.position_covariance[0] + light.position_covariance[3] + light.position_covariance[5]);
    }
    measure::print_line({{"room", room.name},
                         {"lamps", method},
                         {"lamp", k},
                         {"window", k + 1 == room.lamps.size()},
                         {"off_m", off},
                         {"sigma_m", sigma},
                         {"nearest_probe_m", nearest},
                         {"relative", off / nearest}});
  }
}

/// Seconds of this thread's processor for a call: the best of five rounds over the room's points.
template <class Call>
double seconds_of(const FieldRoom& room, Call&& call) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 5; ++round) {
    constexpr int kRepeats = 20;
    const double begin = bench::thread_time_ms();
    for (int repeat = 0; repeat < kRepeats; ++repeat)
      for (const PointTruth& point : room.points) call(point.position);
    const double ms = bench::thread_time_ms() - begin;
    best = std::min(best, 1e-3 * ms / (kRepeats * static_cast<double>(room.points.size())));
  }
  return best;
}

volatile float kept;  ///< Keeps the compiler from removing the computation.

void measure_speed(const FieldRoom& room, LightField& field, const std::vector<FieldSample>& samples,
                   const std::string& method, const bench::MemcpySpeed& copy) {
  const Lighting one = Lighting::of(samples.front().light);
  const double reference = seconds_of(room, [&](Vec3d p) {
    kept = one.irradiance(vec_cast<float>(p + Vec3d{0, 0.1, 0})).value.r;
  });
  const double at = seconds_of(room, [&](Vec3d p) { kept = field.at(p, {}).light.descriptor().bound.total; });
  const double irradiance = seconds_of(room, [&](Vec3d p) { kept = field.irradiance(p, {0, 1, 0}, {}).value.r; });
  const double begin = bench::thread_time_ms();
  (void)field.update({});
  const double update_ms = bench::thread_time_ms() - begin;
  measure::print_line({{"room", room.name},
                       {"speed", method},
                       {"at_us", 1e6 * at},
                       {"irradiance_us", 1e6 * irradiance},
                       {"lighting_irradiance_us", 1e6 * reference},
                       {"at_ratio", at / reference},
                       {"irradiance_ratio", irradiance / reference},
                       {"update_ms", update_ms},
                       {"memcpy_gb_s", copy.gigabytes_per_s}});
}

LightField field_of(const std::vector<FieldSample>& samples) {
  LightField field = require(LightField::make());
  for (std::size_t k = 0; k < samples.size(); ++k) require(field.set("probe " + std::to_string(k), samples[k]));
  (void)field.update({});
  return field;
}

/// The same samples with poses that are off by what their covariances say: 0.5 degrees and 10 mm, from a fixed seed.
std::vector<FieldSample> with_pose_errors(std::vector<FieldSample> samples) {
  constexpr double kRotationSigma = 0.5 / kDegrees, kTranslationSigma = 0.01;
  std::mt19937 random(23);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) { return Vec3d{normal(random), normal(random), normal(random)} * sigma; };
  for (FieldSample& sample : samples) {
    Pose& pose = sample.T_world_probe.pose;
    const Vec3d turn = draw(kRotationSigma);
    pose.rotation = Quat::about(normalized(turn), length(turn)) * pose.rotation;
    pose.translation += draw(kTranslationSigma);
    for (std::size_t i = 0; i < 6; ++i) {
      const double sigma = i < 3 ? kRotationSigma : kTranslationSigma;
      sample.T_world_probe.covariance[i][i] = sigma * sigma;
    }
  }
  return samples;
}

/// The same samples in relative units with a factor of each probe: 1/4, 1/2, 1, 2, ...
std::vector<FieldSample> with_unknown_scales(std::vector<FieldSample> samples) {
  float factor = 0.25F;
  for (std::size_t k = 0; k < samples.size(); ++k, factor *= 2) {
    Descriptor& d = samples[k].light;
    d.units = Units::relative;
    d.calibration_id = static_cast<std::uint32_t>(k + 1);
    for (auto& c : d.radiance.c) c = c * factor;
    for (Light& light : d.lights) light.irradiance = light.irradiance * factor;
  }
  return samples;
}

/// Largest error of the factors between the probes that with_unknown_scales() scaled, relative.
void measure_scales(const FieldRoom& room, const std::vector<FieldSample>& samples) {
  const LightField field = field_of(with_unknown_scales(samples));
  double low = std::numeric_limits<double>::infinity(), high = 0, factor = 0.25;
  int used = 0;
  for (const FieldProbe& probe : field.state()->probes) {
    const double error = probe.scale * factor;
    factor *= 2;
    if (probe.state == FieldProbeState::wrong_scale) continue;
    ++used;
    low = std::min(low, error);
    high = std::max(high, error);
  }
  measure::print_line({{"room", room.name}, {"scales_used", used}, {"scale_error", high / low - 1}});
}

void describe(const FieldRoom& room, const LightField& field, const std::vector<FieldSample>& samples) {
  const auto state = field.state();
  for (const FieldProbe& p : state->probes)
    measure::print_line({{"room", room.name},
                         {"probe", p.name},
                         {"state", to_string(p.state)},
                         {"scale", p.scale},
                         {"lights", p.lights},
                         {"matched", p.matched},
                         {"ambiguous", p.ambiguous}});
  for (const FieldLight& l : state->lights)
    measure::print_line({{"room", room.name},
                         {"light", l.id},
                         {"placed", l.placed},
                         {"probes", l.probes},
                         {"position", {l.position.x, l.position.y, l.position.z}},
                         {"radius", l.radius},
                         {"intensity", l.intensity.luminance()},
                         {"gradient",
                          {l.intensity_gradient[0].luminance(), l.intensity_gradient[1].luminance(),
                           l.intensity_gradient[2].luminance()}}});
  for (const FieldSample& s : samples)
    for (const Light& l : s.light.lights) {
      const Vec3f d = rotate(s.T_world_probe.pose.rotation, l.direction);
      measure::print_line({{"room", room.name},
                           {"listed", {d.x, d.y, d.z}},
                           {"irradiance", l.irradiance.luminance()},
                           {"radius_deg", kDegrees * static_cast<double>(l.angular_radius_rad)},
                           {"bound", s.light.bound.total},
                           {"band", s.light.radiance.band}});
    }
}

void measure_room(const std::string& folder, const std::string& name, bool each_point, bool verbose,
                  const bench::MemcpySpeed& copy) {
  const FieldRoom room = require(measure::load_field_room(folder, name));
  const std::vector<FieldSample> samples = measure::samples_of(room, require(measure::probe_descriptors(room)));
  LightField field = field_of(samples);
  if (verbose) describe(room, field, samples);
  measure_lamps(room, field, "field");
  measure_points(room, samples, field, "field", each_point);
  measure_speed(room, field, samples, "field", copy);
  measure_scales(room, samples);
  const std::vector<FieldSample> off = with_pose_errors(samples);
  LightField off_field = field_of(off);
  measure_lamps(room, off_field, "poses with errors");
  if (!field_has_geometry()) return;
  const measure::RoomGeometry geometry = measure::geometry_of(room);
  require(field.set_geometry({geometry.vertices, geometry.indices}));
  (void)field.update({});
  measure_points(room, samples, field, "field with geometry", each_point);
  measure_speed(room, field, samples, "field with geometry", copy);
  require(off_field.set_geometry({geometry.vertices, geometry.indices}));
  (void)off_field.update({});
  measure_points(room, off, off_field, "poses with errors, geometry", each_point);
}

}  // namespace

int main(int argc, char** argv) {
  std::string only, folder = measure::field_rooms_folder();
  bool each_point = false, verbose = false;
  CLI::App app{"Error, bound and time of the light field in path-traced rooms.", "measure_field"};
  app.add_option("--room", only, "Measure this room alone: square, corridor or corner");
  app.add_option("--rooms", folder, "Other rooms, of render.py with another seed");
  app.add_flag("--points", each_point, "Print a line for each point as well");
  app.add_flag("--lights", verbose, "Print the lights of probes and field as well");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return lightwell::run_command(app, {argv + 1, argv + argc}, [&] {
    const bench::MemcpySpeed copy = bench::memcpy_speed(std::size_t{640} * 480 * 3);
    for (const char* name : measure::kFieldRooms)
      if (only.empty() || only == name) measure_room(folder, name, each_point, verbose, copy);
    return 0;
  });
}
