#include "measure/viewer_trials.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <sstream>

#include <nlohmann/json.hpp>

#include <lightwell/color.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/quantile.hpp>

#include "imaging/image_file.hpp"

namespace lightwell::measure {
namespace {

using nlohmann::json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastDepth = 0.03;
/// Around the object's foot, where it takes light of the sky, too: not counted for the centroid, in whose direction the
/// tip is searched.
constexpr double kFootMargin_m = 0.005;
constexpr int kEdgePx = 2;
/// How much of the shadow counts as its tip, in radii of the object, and how often the axis is aligned with it.
constexpr double kTipDepth = 1.5;
constexpr int kTipSteps = 4;

Vec3d vector_of(const json& v) { return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()}; }

Result<std::string> text_of(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status(StatusCode::not_found, path + " cannot be read; tests/reference/mitsuba/viewer/README.md");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Runs `parse`, whose exceptions become data_loss.
template <class Parse>
Status parsed(const std::string& where, const Parse& parse) {
  try {
    parse();
  } catch (const json::exception& e) {
    return {StatusCode::data_loss, where + ": " + e.what()};
  }
  return {};
}

double luminance(const std::array<float, 3>& c) {
  return luminance_of(static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2]));
}

double azimuth_of(const Vec3d& d) { return std::atan2(d.x, d.z) / kDegree; }

/// Centre of the shadow of the object's top: a disc, of any size where the lamp is near. From the outline's farthest
/// place along the shadow's axis and its sides near there.
Vec3d tip_of(const TrialSetup& setup, const std::vector<Segment>& outline, Vec3d axis) {
  std::vector<Vec3d> places;
  for (const Segment& s : outline)
    if (const auto p = setup.on_table(s.from.x, s.from.y)) places.push_back(*p);
  Vec3d tip;
  for (int k = 0; k < kTipSteps; ++k) {
    const Vec3d across = cross(Vec3d{0, 1, 0}, axis);
    double farthest = 0, left = std::numeric_limits<double>::infinity(), right = -left;
    for (const Vec3d& p : places) farthest = std::max(farthest, dot(p, axis));
    for (const Vec3d& p : places) {
      if (dot(p, axis) < farthest - kTipDepth * setup.object_radius_m) continue;
      left = std::min(left, dot(p, across)), right = std::max(right, dot(p, across));
    }
    tip = axis * (farthest - (right - left) / 2) + across * ((right + left) / 2);
    axis = normalized(tip);
  }
  return tip;
}

}  // namespace

Vec3d TrialSetup::ray(double u, double v) const {
  return rotate(T_world_camera.rotation, normalized(Vec3d{(u - cx) / fx, (cy - v) / fy, -1}));
}

std::optional<Vec3d> TrialSetup::on_table(double u, double v) const {
  const Vec3d eye = T_world_camera.translation, d = ray(u, v);
  if (!(d.y < 0)) return std::nullopt;
  const Vec3d p = eye + d * (-eye.y / d.y);
  if (std::abs(p.x) > table_m[0] / 2 || std::abs(p.z) > table_m[1] / 2) return std::nullopt;
  return Vec3d{p.x, 0, p.z};
}

bool TrialSetup::on_object(double u, double v) const {
  const Vec3d eye = T_world_camera.translation, d = ray(u, v);
  const auto inside = [&](double t) {
    const Vec3d p = eye + d * t;
    return t > 0 && p.y >= 0 && p.y <= object_height_m;
  };
  const double top = (object_height_m - eye.y) / d.y;
  const Vec3d at_top = eye + d * top;
  if (top > 0 && std::hypot(at_top.x, at_top.z) <= object_radius_m) return true;
  const double a = d.x * d.x + d.z * d.z, b = eye.x * d.x + eye.z * d.z;
  const double c = eye.x * eye.x + eye.z * eye.z - object_radius_m * object_radius_m, root = b * b - a * c;
  if (root < 0 || !(a > 0)) return false;
  return inside((-b - std::sqrt(root)) / a) || inside((-b + std::sqrt(root)) / a);
}

Result<TrialSetup> load_trial_setup(const std::string& folder) {
  const std::string path = folder + "/setup.json";
  const Result<std::string> text = text_of(path);
  if (!text) return text.status();
  TrialSetup out;
  out.folder = folder;
  const Status status = parsed(path, [&] {
    const json from = json::parse(*text);
    const json& camera = from.at("camera");
    out.width = camera.at("width"), out.height = camera.at("height");
    out.fx = camera.at("fx"), out.fy = camera.at("fy"), out.cx = camera.at("cx"), out.cy = camera.at("cy");
    const json& pose = from.at("T_world_camera");
    const json& q = pose.at("rotation");
    out.T_world_camera = {Quat{q.at(0), q.at(1), q.at(2), q.at(3)}, vector_of(pose.at("position"))};
    out.object_height_m = from.at("object_height_m");
    out.object_radius_m = from.at("object_diameter_m").get<double>() / 2;
    out.object_albedo = from.at("object_albedo");
    out.table_m = from.at("table_m");
  });
  if (!status.ok()) return status;
  return out;
}

Result<std::vector<ViewerTrial>> load_viewer_trials(const std::string& folder) {
  const std::string path = folder + "/trials.jsonl";
  const Result<std::string> text = text_of(path);
  if (!text) return text.status();
  std::vector<ViewerTrial> out;
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    const Status status = parsed(path + ", line " + std::to_string(out.size() + 1), [&] {
      const json from = json::parse(line);
      out.push_back({from.at("name"), from.at("azimuth_deg"), from.at("elevation_deg"), from.at("distance_m"),
                     from.at("width"), vector_of(from.at("probe_top")), vector_of(from.at("probe_away")),
                     from.at("shadow_m"), from.at("gain")});
    });
    if (!status.ok()) return status;
  }
  return out;
}

Result<ColorPicture> read_color_picture(const std::string& path) {
  const Result<Image> image = read_image(path);
  if (!image) return image.status();
  ColorPicture out{image->width, image->height, {}};
  out.values.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  if (image->format == PixelFormat::rgb_f32) {
    std::memcpy(out.values.data(), image->data.data(), out.values.size() * sizeof(out.values[0]));
    return out;
  }
  std::array<float, 256> linear{};
  for (std::size_t k = 0; k < linear.size(); ++k)
    linear[k] = static_cast<float>(srgb_to_linear(static_cast<double>(k) / 255));
  for (std::size_t i = 0; i < out.values.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) out.values[i][c] = linear[std::to_integer<std::size_t>(image->data[3 * i + c])];
  return out;
}

std::vector<Seen> seen_by(const TrialSetup& setup) {
  std::vector<Seen> out;
  out.reserve(static_cast<std::size_t>(setup.width) * static_cast<std::size_t>(setup.height));
  for (int y = 0; y < setup.height; ++y)
    for (int x = 0; x < setup.width; ++x) {
      int hits = 0, count = 0;
      for (int b = -kEdgePx; b <= kEdgePx; b += kEdgePx)
        for (int a = -kEdgePx; a <= kEdgePx; a += kEdgePx) hits += setup.on_object(x + a, y + b) ? 1 : 0, ++count;
      if (hits > 0)
        out.push_back(hits == count ? Seen::object : Seen::edge);
      else
        out.push_back(setup.on_table(x, y) ? Seen::table : Seen::other);
    }
  return out;
}

double shadow_reach_m(double shadow_m) { return 1.3 * shadow_m + 0.06; }

GreyPicture light_ratio(const TrialSetup& setup, const ViewerTrial& trial, const ColorPicture& with,
                        const ColorPicture& without) {
  GreyPicture out(setup.width, setup.height, std::numeric_limits<double>::quiet_NaN());
  const std::vector<Seen> seen = seen_by(setup);
  const double reach = shadow_reach_m(trial.shadow_m);
  for (int y = 0; y < setup.height; ++y)
    for (int x = 0; x < setup.width; ++x) {
      const auto place = setup.on_table(x, y);
      const auto index =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(setup.width) + static_cast<std::size_t>(x);
      if (!place || seen[index] != Seen::table || std::hypot(place->x, place->z) > reach) continue;
      const double light = luminance(without.at(x, y));
      if (light > 0) out.at(x, y) = luminance(with.at(x, y)) / light;
    }
  return box_means(out, 1);
}

std::optional<Shadow> shadow_of(const TrialSetup& setup, const GreyPicture& ratio) {
  std::vector<double> depths;
  for (const double v : ratio.values)
    if (!std::isnan(v)) depths.push_back(1 - v);
  if (depths.empty()) return std::nullopt;
  // The inside of the shadow: the median of what is at least half as deep as its deepest parts, noise left aside.
  const double deepest = lower_quantile(depths, 0.999);
  std::erase_if(depths, [&](double d) { return d < deepest / 2; });
  Shadow out;
  out.depth = lower_quantile(depths, 0.5);
  if (!(out.depth > kLeastDepth)) return std::nullopt;
  out.outline = contour(ratio, 1 - out.depth / 2);
  Vec3d sum;
  for (int y = 0; y < ratio.height; ++y)
    for (int x = 0; x < ratio.width; ++x) {
      const double v = ratio.at(x, y);
      if (std::isnan(v) || v > 1 - out.depth / 2) continue;
      const Vec3d p = setup.on_table(x, y).value_or(Vec3d{});
      // Pixels see areas that grow with the cube of the distance, by the same cosine.
      const double distance = length(p - setup.T_world_camera.translation);
      if (std::hypot(p.x, p.z) > setup.object_radius_m + kFootMargin_m) sum += p * (distance * distance * distance);
    }
  if (!(length(sum) > 0)) return std::nullopt;
  const Vec3d tip = tip_of(setup, out.outline, normalized(sum));
  out.azimuth_deg = azimuth_of(-tip);
  out.elevation_deg = std::atan2(setup.object_height_m, length(tip)) / kDegree;
  return out;
}

double angle_difference_deg(double a, double b) { return std::remainder(a - b, 360.0); }

}  // namespace lightwell::measure
