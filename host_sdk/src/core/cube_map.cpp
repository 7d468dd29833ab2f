#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <lightwell/cube_map.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/query.hpp>

namespace lightwell {
namespace {

constexpr int kFaces = 6;
/// Samples along the edge of a face: two for each texel of the finest cube map. The sharpest texels of an environment
/// map are three times as wide; harmonics up to band 6 need half as many.
constexpr int kMapSamples = 2 * kMaxCubeEdge, kHarmonicsSamples = kMaxCubeEdge;
/// Samples along the edge of a texel that the border of a light crosses.
constexpr int kLightSamples = 16;

/// Where a face's centre, right and down point.
struct FaceAxes {
  Vec3f forward, right, down;
};
constexpr std::array<FaceAxes, kFaces> kFaceAxes = {{{{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
                                                     {{-1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
                                                     {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
                                                     {{0, -1, 0}, {1, 0, 0}, {0, 0, -1}},
                                                     {{0, 0, 1}, {1, 0, 0}, {0, -1, 0}},
                                                     {{0, 0, -1}, {-1, 0, 0}, {0, -1, 0}}}};

/// Solid angle of the part of a face from its centre to the place a, b on it, each -1 to 1.
double corner_solid_angle(double a, double b) { return std::atan2(a * b, std::sqrt(1 + a * a + b * b)); }

/// A texel of a face, or the samples inside of it.
struct CubeTexel {
  int face = 0, column = 0, row = 0;
  int edge = 1;

  [[nodiscard]] double border(int k) const { return 2.0 * k / edge - 1; }

  [[nodiscard]] double solid_angle() const {
    const double left = border(column), right = border(column + 1), top = border(row), bottom = border(row + 1);
    return corner_solid_angle(right, bottom) - corner_solid_angle(left, bottom) - corner_solid_angle(right, top) +
           corner_solid_angle(left, top);
  }

  [[nodiscard]] Vec3d center() const {
    const auto n = static_cast<float>(edge);
    return vec_cast<double>(
        cube_direction(face, (static_cast<float>(column) + 0.5F) / n, (static_cast<float>(row) + 0.5F) / n));
  }

  /// Upper limit of the angle between the centre and any other direction of the texel, rad: half of a diagonal, which
  /// nothing sees larger than from the distance of the face's centre.
  [[nodiscard]] double radius() const { return std::numbers::sqrt2 / edge; }
};

/// Calls visit(direction, weight) for `count` x `count` places in a texel. Weights are solid angles and sum up to
/// about that of the texel.
template <class Visit>
void sample(const CubeTexel& texel, int count, const Visit& visit) {
  const FaceAxes& axes = kFaceAxes[static_cast<std::size_t>(texel.face)];
  const float step = 2 / static_cast<float>(texel.edge * count);
  for (int j = 0; j < count; ++j) {
    const float b = (static_cast<float>(texel.row * count + j) + 0.5F) * step - 1;
    const Vec3f line = axes.forward + axes.down * b;
    for (int i = 0; i < count; ++i) {
      const float a = (static_cast<float>(texel.column * count + i) + 0.5F) * step - 1;
      const float inverse = 1 / std::sqrt(1 + a * a + b * b);
      visit((line + axes.right * a) * inverse, step * step * inverse * inverse * inverse);
    }
  }
}

template <class Visit>
void for_each_texel(int edge, const Visit& visit) {
  for (int face = 0; face < kFaces; ++face)
    for (int row = 0; row < edge; ++row)
      for (int column = 0; column < edge; ++column) visit(CubeTexel{face, column, row, edge});
}

/// Number of the texel in the order of for_each_texel() that contains a direction.
int texel_with(Vec3d d, int edge) {
  const std::array<double, 3> v = {d.x, d.y, d.z};
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(v[static_cast<std::size_t>(k)]) > std::abs(v[static_cast<std::size_t>(axis)])) axis = k;
  const int face = 2 * axis + (v[static_cast<std::size_t>(axis)] < 0 ? 1 : 0);
  const FaceAxes& axes = kFaceAxes[static_cast<std::size_t>(face)];
  const double distance = dot(vec_cast<double>(axes.forward), d);
  const auto index = [&](Vec3f along) {
    const double place = dot(vec_cast<double>(along), d) / distance;
    return std::clamp(static_cast<int>((place + 1) / 2 * edge), 0, edge - 1);
  };
  return (face * edge + index(axes.down)) * edge + index(axes.right);
}

/// A light, spread over the texels that its cap covers: first add() of every texel, then finish(), then radiance.
class SpreadLight {
 public:
  SpreadLight() = default;
  SpreadLight(const Light& light, int edge)
      : axis_(normalized(vec_cast<double>(light.direction))),
        cos_rho_(std::cos(static_cast<double>(light.angular_radius_rad))),
        // Radiance times solid angle of a cap whose vector irradiance is pi sin²(rho) times its radiance.
        energy_(light.irradiance * static_cast<float>(2 / (1 + cos_rho_))) {
    const double rho = static_cast<double>(light.angular_radius_rad), texel = CubeTexel{0, 0, 0, edge}.radius();
    cos_outside_ = rho + texel < std::numbers::pi ? std::cos(rho + texel) : -1;
    cos_inside_ = rho > texel ? std::cos(rho - texel) : 2;
  }

  void add(const CubeTexel& texel, Vec3d center) { covered_ += covered_solid_angle(texel, center); }

  void finish(int edge) {
    if (covered_ > 0)
      energy_ = energy_ * static_cast<float>(1 / covered_);
    else  // Between two samples.
      point_in_ = texel_with(axis_, edge);
  }

  /// Mean over the texel, number `index` of for_each_texel().
  [[nodiscard]] Radiance mean_radiance(const CubeTexel& texel, Vec3d center, int index) const {
    const double covered = point_in_ < 0 ? covered_solid_angle(texel, center) : index == point_in_ ? 1 : 0;
    if (covered == 0) return {};
    const Irradiance e = energy_ * static_cast<float>(covered / texel.solid_angle());
    return {e.r, e.g, e.b};
  }

 private:
  [[nodiscard]] double covered_solid_angle(const CubeTexel& texel, Vec3d center) const {
    const double c = dot(axis_, center);
    if (c < cos_outside_) return 0;
    if (c > cos_inside_) return texel.solid_angle();
    double sum = 0;
    sample(texel, kLightSamples, [&](Vec3f d, float weight) {
      if (dot(axis_, vec_cast<double>(d)) >= cos_rho_) sum += static_cast<double>(weight);
    });
    return sum;
  }

  Vec3d axis_;
  double cos_rho_ = 1;
  double cos_outside_ = 1, cos_inside_ = 2;  ///< Of the angle to a texel's centre, where it is wholly out or in.
  double covered_ = 0;                       ///< Solid angle, sr.
  Irradiance energy_;                        ///< After finish(): per covered solid angle, or all that of a point.
  int point_in_ = -1;                        ///< The texel of a point; -1: the light is none.
};

/// The bits of a half float, rounded to the nearest, ties to even. v: 0 to 65504.
std::uint16_t half_bits(float v) {
  constexpr float kSmallestNormal = 0x1p-14F, kSubnormalUnit = 0x1p-24F;
  if (v < kSmallestNormal) return static_cast<std::uint16_t>(std::lrint(v / kSubnormalUnit));
  const auto bits = std::bit_cast<std::uint32_t>(v) - (112U << 23);
  return static_cast<std::uint16_t>((bits + 0xFFFU + ((bits >> 13) & 1U)) >> 13);
}

float largest_of(CubeFormat format) {
  switch (format) {
    case CubeFormat::rgba16f:
      return 65504;
    case CubeFormat::rgba32f:
      return std::numeric_limits<float>::max();
    case CubeFormat::rgb9e5:
      return 65408;
  }
  return 0;
}

/// Writes the texel whose values are within the range of the format.
void write(const std::array<float, 3>& v, CubeFormat format, std::byte* to) {
  const auto put = [to](const auto& texel) { std::memcpy(to, &texel, sizeof texel); };
  switch (format) {
    case CubeFormat::rgba16f:
      put(std::array<std::uint16_t, 4>{half_bits(v[0]), half_bits(v[1]), half_bits(v[2]), 0x3C00});
      break;
    case CubeFormat::rgba32f:
      put(std::array<float, 4>{v[0], v[1], v[2], 1});
      break;
    case CubeFormat::rgb9e5:
      put(rgb9e5_encode(v[0], v[1], v[2]));
      break;
  }
}

}  // namespace

Vec3f cube_direction(int face, float u, float v) {
  const FaceAxes& axes = kFaceAxes[static_cast<std::size_t>(std::clamp(face, 0, kFaces - 1))];
  return normalized(axes.forward + axes.right * (2 * u - 1) + axes.down * (2 * v - 1));
}

Answer<std::size_t> cube_map(const Lighting& light, const CubeMapOptions& options, std::span<std::byte> texels) {
  const Answer<Radiance> about = light.radiance({0, 1, 0}, 0);
  Answer<std::size_t> out{0, about.validity, about.age, about.error_bound, about.flags, options.lights};
  const float largest = largest_of(options.format);
  const std::size_t bytes = cube_map_bytes(options.edge, options.format);
  if (bytes == 0 || texels.size() != bytes || largest == 0 || !(options.scale > 0) || !std::isfinite(options.scale)) {
    out.validity = Validity::invalid_query;
    return out;
  }
  const std::optional<EnvironmentView> view = light.environment();
  const Quat to_map = view ? view->rotation.inverse() : Quat{};
  const bool with_lights = options.lights == LightsIncluded::yes;
  const auto sharp = [&](Vec3f d) {
    if (!view) return light.radiance(d, 0).value;
    return environment_radiance(with_lights ? view->mirror : view->map, rotate(to_map, d), 0);
  };
  const int wanted = view ? kMapSamples : kHarmonicsSamples;
  const int samples = (wanted + options.edge - 1) / options.edge;

  // No message has more lights.
  std::array<SpreadLight, kMaxLights> spread;
  std::size_t lights = 0;
  if (with_lights)
    for (const Light& one : light.lights().first(std::min(light.lights().size(), spread.size())))
      if (!view || !view->shown_in_mirror(one)) spread[lights++] = SpreadLight(one, options.edge);
  const std::span<SpreadLight> caps = std::span(spread).first(lights);
  if (!caps.empty())
    for_each_texel(options.edge, [&](const CubeTexel& texel) {
      const Vec3d center = texel.center();
      for (SpreadLight& cap : caps) cap.add(texel, center);
    });
  for (SpreadLight& cap : caps) cap.finish(options.edge);

  const std::size_t stride = bytes / (static_cast<std::size_t>(kFaces * options.edge) * options.edge);
  int index = 0;
  for_each_texel(options.edge, [&](const CubeTexel& texel) {
    Radiance sum;
    float weights = 0;
    sample(texel, samples, [&](Vec3f d, float weight) {
      sum += sharp(d) * weight;
      weights += weight;
    });
    Radiance mean = sum * (1 / weights);
    const Vec3d center = texel.center();
    for (const SpreadLight& cap : caps) mean += cap.mean_radiance(texel, center, index);
    std::array<float, 3> values{};
    bool above = false;
    for (int c = 0; c < 3; ++c) {
      const float v = mean[c] * options.scale;
      above = above || v > largest;
      values[static_cast<std::size_t>(c)] = v > 0 ? std::min(v, largest) : 0;
    }
    if (above) ++out.value;
    write(values, options.format, texels.data() + static_cast<std::size_t>(index) * stride);
    ++index;
  });
  return out;
}

}  // namespace lightwell
