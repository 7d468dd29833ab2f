#include "measure/specular_sequences.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <lightwell/descriptor.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "measure/panorama_truth.hpp"
#include "reference/bright_region.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::measure {
namespace {

Pose pose_of(const reference::Pose& camera_plane) {
  // Shepperd's method for the rows of a rotation matrix; the lens is the probe turned to its _cv axes.
  const auto& m = camera_plane.rotation;
  const double trace = m[0].x + m[1].y + m[2].z;
  Quat q;
  if (trace > 0) {
    const double s = 2 * std::sqrt(trace + 1);
    q = {(m[2].y - m[1].z) / s, (m[0].z - m[2].x) / s, (m[1].x - m[0].y) / s, s / 4};
  } else if (m[0].x > m[1].y && m[0].x > m[2].z) {
    const double s = 2 * std::sqrt(1 + m[0].x - m[1].y - m[2].z);
    q = {s / 4, (m[0].y + m[1].x) / s, (m[0].z + m[2].x) / s, (m[2].y - m[1].z) / s};
  } else if (m[1].y > m[2].z) {
    const double s = 2 * std::sqrt(1 + m[1].y - m[0].x - m[2].z);
    q = {(m[0].y + m[1].x) / s, s / 4, (m[1].z + m[2].y) / s, (m[0].z - m[2].x) / s};
  } else {
    const double s = 2 * std::sqrt(1 + m[2].z - m[0].x - m[1].y);
    q = {(m[0].z + m[2].x) / s, (m[1].z + m[2].y) / s, s / 4, (m[1].x - m[0].y) / s};
  }
  const reference::V3& t = camera_plane.translation;
  return compose(Pose{upright_lens_cv(), {}}, Pose{q.normalized(), {t.x, t.y, t.z}});
}

RigParameters pinhole_rig(const SpecularSequenceOptions& o) {
  LensParameters lens;
  lens.width = o.width, lens.height = o.height;
  lens.model = MeiParameters{o.focal_px, o.focal_px, (o.width - 1) / 2.0, (o.height - 1) / 2.0, 0, 0, 0, 0, 0};
  lens.max_angle_rad = std::atan(std::hypot(o.width, o.height) / 2 / o.focal_px) + 0.01;
  lens.pose_cv = {upright_lens_cv(), {}};
  // A full well of 10,000 electrons, read noise of 3.
  lens.photometry.response.kind = ResponseCurve::Kind::srgb;
  lens.photometry.shot_noise = 1e-4;
  lens.photometry.read_noise = 3e-4;
  RigParameters rig;
  rig.lenses = {lens};
  rig.nits_per_unit = 1;
  return rig;
}

double luminance_of(const reference::Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

/// The light that irradiates the plane most, of the brightest ones, becomes as dark as what is around it.
reference::Panorama without_strongest_light(const reference::Panorama& environment) {
  constexpr double kReach_rad = 0.35;
  reference::Panorama out = reference::cleaned(environment);
  reference::V3 strongest{0, 1, 0};
  double most = 0;
  for (const reference::BrightRegion& r : reference::bright_regions(out, 20))
    if (const double e = r.direction.y * luminance_of(r.vector_irradiance); e > most) most = e, strongest = r.direction;
  const auto near = [&](int i, int j) {
    return reference::dot(reference::pixel_direction(i, j, out.width, out.height), strongest) > std::cos(kReach_rad);
  };
  std::vector<double> around;
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i)
      if (near(i, j)) around.push_back(luminance_of(reference::pixel(out, i, j)));
  const double limit = median(around);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      reference::Rgb p = reference::pixel(out, i, j);
      const double luminance = luminance_of(p);
      if (!near(i, j) || !(luminance > limit)) continue;
      for (double& c : p) c *= limit / luminance;
      reference::set_pixel(out, i, j, p);
    }
  return out;
}

/// All options that pictures depend on.
std::string text_of(const SpecularSequenceOptions& o) {
  std::ostringstream out;
  out << std::hexfloat << o.environment << ' ' << o.alpha << ' ' << static_cast<int>(o.fresnel) << ' '
      << o.right_alpha.value_or(-1) << ' ' << o.curl << ' ' << o.textured << ' ' << o.albedo.n << ' ' << o.seed << ' '
      << o.frames << ' ' << o.turns << ' ' << o.highest_deg << ' ' << o.lowest_deg << ' ' << o.farthest_m << ' '
      << o.light_out_at.value_or(-1) << ' ' << o.hand_frames << ' ' << o.width << ' ' << o.height << ' ' << o.focal_px
      << ' ' << o.white << ' ' << o.exposure_factor << ' ' << static_cast<int>(o.format);
  for (const double v : o.albedo.rgb) out << ' ' << v;
  return out.str();
}

/// An ellipse of the colour of skin, a third of the picture wide, that moves across it.
void draw_hand(reference::GlossyView& view, int frame) {
  const double cx = view.width * (0.3 + 0.02 * (frame % 20)), cy = 0.55 * view.height;
  const double rx = view.width / 6.0, ry = view.height / 3.0;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      if (std::hypot((x - cx) / rx, (y - cy) / ry) > 1) continue;
      const auto at = static_cast<std::size_t>(3 * (y * view.width + x));
      view.rgb[at] = 0.35, view.rgb[at + 1] = 0.22, view.rgb[at + 2] = 0.16;
    }
}

/// `environment`: as SpecularSequenceOptions, or "room:FILE" of tests/reference/mitsuba/rooms, or "panorama:NAME".
struct NamedSequence {
  const char* name;
  const char* environment;
  double alpha;
  std::uint64_t seed;
  int frames;
  double exposure_factor;
};
constexpr NamedSequence kSequences[] = {
    {"living room 0.32", "room:living_room.exr", 0.1, 11, 600, 1},
    {"living room 0.17", "room:living_room.exr", 0.03, 12, 900, 1},
    {"office 0.45", "room:office.exr", 0.2, 13, 600, 1},
    {"interior 0.32", "panorama:interior", 0.1, 14, 450, 1},
    {"lamps 0.17", "lamps", 0.03, 15, 900, 1},
    {"studio 0.17, saturated", "panorama:studio", 0.03, 16, 600, 1},
    {"office 0.32, exposure varies eightfold", "room:office.exr", 0.1, 17, 600, 8},
};

}  // namespace

std::vector<std::string> sequence_names() {
  std::vector<std::string> out;
  for (const NamedSequence& s : kSequences) out.emplace_back(s.name);
  return out;
}

Result<SpecularSequenceOptions> sequence_options(const std::string& name) {
  for (const NamedSequence& s : kSequences) {
    if (s.name != name) continue;
    SpecularSequenceOptions out;
    out.name = name, out.environment = s.environment, out.alpha = s.alpha, out.seed = s.seed, out.frames = s.frames;
    out.exposure_factor = s.exposure_factor;
    const std::string::size_type colon = out.environment.find(':');
    if (colon == std::string::npos) return out;
    const std::string kind = out.environment.substr(0, colon), file = out.environment.substr(colon + 1);
    if (kind == "room") {
      out.environment = std::string(LIGHTWELL_REFERENCE_ROOMS) + "/" + file;
      return out;
    }
    const Result<std::vector<std::string>> paths = eight_panoramas();
    if (!paths) return paths.status();
    for (const std::string& path : *paths)
      if (path.find("/" + file + ".") != std::string::npos) {
        out.environment = path;
        return out;
      }
    return Status(StatusCode::not_found, "panorama " + file + ": not among those of cmake/fetch_panoramas");
  }
  return Status(StatusCode::not_found, "sequence '" + name + "'; there are: " + joined(sequence_names()));
}

Result<reference::Panorama> load_environment(const std::string& path) {
  Result<PanoramaTruth> truth = load_panorama_truth(path);
  if (!truth) return truth.status();
  const reference::Panorama& full = truth->sums.panorama();
  const int factor = std::max(1, full.width / 512);
  reference::Panorama out{full.width / factor, full.height / factor, {}};
  out.rgb.resize(static_cast<std::size_t>(3 * out.width * out.height));
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      reference::Rgb sum{};
      double weight = 0;
      for (int y = j * factor; y < (j + 1) * factor; ++y)
        for (int x = i * factor; x < (i + 1) * factor; ++x) {
          const double sr = reference::pixel_solid_angle(y, full.width, full.height);
          const reference::Rgb p = reference::pixel(full, x, y);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += sr * p[c];
          weight += sr;
        }
      for (std::size_t c = 0; c < 3; ++c) sum[c] /= weight;
      reference::set_pixel(out, i, j, sum);
    }
  return out;
}

SpecularSequence::LitScene SpecularSequence::lit_by(reference::Panorama environment) const {
  LitScene out;
  out.environment = std::move(environment);
  const auto table = [&](double alpha) {
    reference::Gloss gloss{alpha};
    gloss.fresnel = options_.fresnel;
    return alpha > 0 ? std::make_unique<reference::SpecularTable>(out.environment, gloss) : nullptr;
  };
  out.table = table(options_.alpha);
  reference::GlossyScene& scene = out.scene;
  scene.albedo = options_.albedo.n > 0 ? options_.albedo
                 : options_.textured   ? reference::book_texture(options_.seed, 256)
                                       : reference::plain_texture(8, {0.5, 0.5, 0.5});
  scene.size_m = kPlane_m;
  scene.irradiance = reference::plane_irradiance(out.environment);
  scene.specular = out.table.get();
  if (options_.right_alpha) {
    out.right_table = table(*options_.right_alpha);
    scene.right_half = out.right_table.get();
  }
  scene.curl = options_.curl;
  if (scene.curl != 0) {
    // By a central difference over the slopes that occur.
    const auto at = [&](double slope) {
      return reference::irradiance(out.environment, reference::world_from_plane(reference::normalised({-slope, 0, 1})));
    };
    const reference::Rgb up = at(scene.curl), down = at(-scene.curl);
    for (std::size_t c = 0; c < 3; ++c) scene.irradiance_by_slope[c] = (up[c] - down[c]) / (2 * scene.curl);
  }
  scene.background = {0.1, 0.1, 0.1};
  return out;
}

Result<std::unique_ptr<SpecularSequence>> SpecularSequence::make(const SpecularSequenceOptions& options) {
  std::unique_ptr<SpecularSequence> out(new SpecularSequence(options));
  reference::Panorama environment;
  if (options.environment == "lamps") {
    environment = reference::random_lamps(options.seed, 512, 256, 4);
  } else if (options.environment == "gradient") {
    environment = reference::lamps_on_gradient(512, 256, {1, 1, 1.2}, {0.3, 0.25, 0.2}, {});
  } else {
    Result<reference::Panorama> loaded = load_environment(options.environment);
    if (!loaded) return loaded.status();
    environment = std::move(*loaded);
  }
  const double irradiance = luminance_of(reference::plane_irradiance(environment));
  if (!(irradiance > 0)) return invalid_argument(options.environment + ": no light above the plane");
  const double factor = options.white / (0.8 / reference::pi * irradiance);
  for (double& v : environment.rgb) v *= factor;
  out->lights_.push_back(out->lit_by(environment));
  if (options.light_out_at) out->lights_.push_back(out->lit_by(without_strongest_light(environment)));
  // The guide asks for all directions but those within 10 degrees of the plane (the paper's circle), which needs views
  // from lower ones. Held-out views are from where their pixels' directions are inside the circle.
  reference::TrajectoryOptions path;
  path.highest_deg = options.highest_deg, path.lowest_deg = options.lowest_deg;
  path.farthest_m = options.farthest_m;
  out->trajectory_ = reference::guided_trajectory(options.seed, options.frames, options.turns, path);
  path.highest_deg = 82, path.lowest_deg = 17;
  out->held_out_ = reference::guided_trajectory(options.seed + 1000, kHeldOut * 25, 5, path);
  out->camera_ = std::make_unique<Camera>(pinhole_rig(options), options.format);
  if (options.frames_folder.empty()) return out;
  out->kept_ = options.frames_folder + "/" + std::to_string(fnv1a_32(text_of(options)));
  std::error_code error;
  std::filesystem::create_directory(out->kept_, error);
  if (error) return Status(StatusCode::resource_exhausted, out->kept_ + ": " + error.message());
  if (const auto kept = out->kept_pixels(0); kept && *kept != out->rendered(0).pixels.front())
    return Status(StatusCode::failed_precondition, out->kept_ + ": has pictures of another renderer; remove it");
  return out;
}

reference::PinholeCamera SpecularSequence::pinhole() const {
  return {options_.width, options_.height, options_.focal_px, (options_.width - 1) / 2.0, (options_.height - 1) / 2.0};
}

std::array<double, 1> SpecularSequence::exposures(int k) const {
  const double step = k % 4 == 0   ? 1
                      : k % 4 == 2 ? 1 / options_.exposure_factor
                                   : 1 / std::sqrt(options_.exposure_factor);
  return {kExposure_s * step};
}

Shot SpecularSequence::rendered(int k) const {
  reference::GlossyView view = reference::render_view(scene(k), pinhole(), trajectory_[static_cast<std::size_t>(k)], 2);
  if (k >= 50 && k % 100 >= 50 && k % 100 < 50 + options_.hand_frames) draw_hand(view, k % 100 - 50);
  LensRadiance radiance(1);
  radiance[0].reserve(view.rgb.size());
  for (const double v : view.rgb) radiance[0].push_back(static_cast<float>(v / kExposure_s));
  return camera_->expose(radiance, exposures(k), static_cast<std::uint64_t>(k));
}

std::optional<std::vector<std::byte>> SpecularSequence::kept_pixels(int k) const {
  if (kept_.empty()) return std::nullopt;
  const std::string path = kept_ + "/" + std::to_string(k);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return std::nullopt;
  std::vector<std::byte> out(static_cast<std::size_t>(size));
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()))) return std::nullopt;
  return out;
}

Shot SpecularSequence::frame(int k) const {
  if (std::optional<std::vector<std::byte>> pixels = kept_pixels(k)) {
    std::vector<std::vector<std::byte>> pictures;
    pictures.push_back(std::move(*pixels));
    return camera_->exposed(std::move(pictures), exposures(k), static_cast<std::uint64_t>(k));
  }
  Shot out = rendered(k);
  if (kept_.empty()) return out;
  // Another program may keep the same picture at this time: whole files appear, or none.
  const std::string path = kept_ + "/" + std::to_string(k), part = path + "." + std::to_string(getpid());
  const std::vector<std::byte>& pixels = out.pixels.front();
  std::ofstream file(part, std::ios::binary);
  file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(pixels.size()));
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(part, path, error);
  if (!file || error) std::filesystem::remove(part, error);
  return out;
}

Pose SpecularSequence::true_pose(int k) const { return pose_of(trajectory_[static_cast<std::size_t>(k)]); }

UncertainPose SpecularSequence::tag_pose(int k) const {
  UncertainPose out;
  out.pose = pose_of(reference::perturbed(
      trajectory_[static_cast<std::size_t>(k)],
      reference::pose_noise(options_.seed, k, options_.rotation_noise_rad, options_.translation_noise_m)));
  reference::SplitMix jumps(options_.seed, static_cast<std::uint64_t>(1'000'000 + k));
  if (jumps.uniform() < options_.jump_share)
    out.pose = compose(Pose{Quat::about({0, 0, 1}, 5 / 180.0 * reference::pi), {0.02, 0, 0}}, out.pose);
  // The noise w, n of the camera (p -> exp(w) p + n) turns the plane by w and moves its origin t by w × t + n.
  const double turn = std::pow(options_.rotation_noise_rad, 2), shift = std::pow(options_.translation_noise_m, 2);
  const Vec3d t = out.pose.translation;
  const double lever[3][3] = {{0, t.z, -t.y}, {-t.z, 0, t.x}, {t.y, -t.x, 0}};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      out.covariance[r][c] = r == c ? turn : 0;
      out.covariance[r + 3][c] = out.covariance[c][r + 3] = turn * lever[r][c];
      double product = r == c ? shift : 0;
      for (std::size_t n = 0; n < 3; ++n) product += turn * lever[r][n] * lever[c][n];
      out.covariance[r + 3][c + 3] = product;
    }
  return out;
}

Pose SpecularSequence::held_out_pose(int k) const { return pose_of(held_out_[static_cast<std::size_t>(k) * 25 + 12]); }

reference::GlossyView SpecularSequence::held_out_view(int k) const {
  return reference::render_view(scene(), pinhole(), held_out_[static_cast<std::size_t>(k) * 25 + 12], 3);
}

reference::GlossyView SpecularSequence::held_out_diffuse(int k) const {
  reference::GlossyScene matte = scene();
  matte.specular = nullptr, matte.background = {};
  return reference::render_view(matte, pinhole(), held_out_[static_cast<std::size_t>(k) * 25 + 12], 3);
}

}  // namespace lightwell::measure
