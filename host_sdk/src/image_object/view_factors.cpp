// Base colour, relative luminance and highlights of a view (equations 3 to 7 of the CyberMirage paper).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <Eigen/Eigenvalues>

#include <lightwell/image_object_encoder.hpp>

namespace lightwell {
namespace {

constexpr float kMaxValue = 1e4F;
/// Largest magnitudes of the components U and V: those of colours of the sRGB cube in Y'UV's scale, 8 bits.
constexpr float kMaxChroma = 0.5F;
/// U and V of Rec. 709 (BT.709, 0.5 / (1 - Kb) and 0.5 / (1 - Kr)).
constexpr float kUScale = 0.5389F, kVScale = 0.6350F;
/// Lights that count for the saturated colour: those that give the pixel at least this share of its largest luminance,
/// and of these the third whose colour is the most saturated.
constexpr float kBrightShare = 0.3F;
constexpr std::size_t kSaturatedPart = 3;
/// Squared difference of two chromaticities below which a share of one cannot be found.
constexpr float kMinDifference2 = 1e-9F;
/// The same to the light's, below which a highlight cannot be told from the base.
constexpr float kMinSaturation2 = 1e-3F;
/// The tolerance from which that holds; below, the limit falls with it.
constexpr float kGreyTolerance = 0.01F;
/// Luminance of unit vectors that are nearly black or nearly of no luminance.
constexpr float kMinLuminance = 1e-3F;

Status size_error(const std::string& what, std::size_t got, std::size_t expected) {
  return invalid_argument(what + " has " + std::to_string(got) + " pixels instead of " + std::to_string(expected) +
                          ": make all pictures of a data set of the same size");
}

bool is_valid(const Radiance& p) {
  return p.r >= 0 && p.g >= 0 && p.b >= 0 && p.r <= kMaxValue && p.g <= kMaxValue && p.b <= kMaxValue;
}

Status check_picture(const std::string& what, std::span<const Radiance> picture, std::size_t pixels) {
  if (picture.size() != pixels) return size_error(what, picture.size(), pixels);
  const auto bad = std::ranges::find_if_not(picture, is_valid);
  if (bad == picture.end()) return {};
  return invalid_argument(what + ": pixel " + std::to_string(bad - picture.begin()) +
                          " is negative, not finite or above 10000: scale the picture to 0 to 1");
}

/// The share of a luminance that has the second colour, in a pixel of colour `colour`, where `base` and base + d are
/// chromaticities (RGB of luminance 1): the least-squares fit of colour / luminance = base + share d.
float fit_share(const Radiance& colour, const Radiance& base, const Radiance& d) {
  const float y = colour.luminance(), d2 = d.r * d.r + d.g * d.g + d.b * d.b;
  if (!(y > 0) || d2 < kMinDifference2) return 0;
  return ((colour.r / y - base.r) * d.r + (colour.g / y - base.g) * d.g + (colour.b / y - base.b) * d.b) / d2;
}

Radiance to_white(const Radiance& base) { return {1 - base.r, 1 - base.g, 1 - base.b}; }

/// Sum over lights of the squared errors of colour = luminance (base + share d).
float squared_errors(const ViewPictures& pictures, std::size_t pixel, const Radiance& base, const Radiance& d) {
  float sum = 0;
  for (const auto& picture : pictures.lit) {
    const Radiance& p = picture[pixel];
    const float share = std::clamp(fit_share(p, base, d), -1.0F, 1.0F);
    const Radiance error = p - (base + d * share) * p.luminance();
    sum += error.r * error.r + error.g * error.g + error.b * error.b;
  }
  return sum;
}

/// Two colours of a pixel: chromaticities `base` and base + difference.
struct ColourPair {
  Radiance base, difference;
};

/// The pair in the plane through black that fits the pixel's colours best, with the point of it nearest to `base`. The
/// difference has the length at which the largest share is 1.
ColourPair best_pair(const ViewPictures& pictures, std::size_t pixel, const Radiance& base) {
  Eigen::Matrix3f gram = Eigen::Matrix3f::Zero();
  for (const auto& picture : pictures.lit) {
    const Eigen::Vector3f p(picture[pixel].r, picture[pixel].g, picture[pixel].b);
    gram += p * p.transpose();
  }
  const Eigen::Vector3f normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(gram).eigenvectors().col(0);
  const Eigen::Vector3f weights(kLuminanceWeights[0], kLuminanceWeights[1], kLuminanceWeights[2]);
  Eigen::Vector3f inside(base.r, base.g, base.b);
  inside -= inside.dot(normal) * normal;
  const float luminance = inside.dot(weights);
  const Eigen::Vector3f along = normal.cross(weights);
  if (!(luminance > kMinLuminance) || !(along.norm() > kMinLuminance)) return {base, to_white(base)};
  inside /= luminance;
  ColourPair out{{inside.x(), inside.y(), inside.z()}, {along.x(), along.y(), along.z()}};
  if (out.base.r < 0 || out.base.g < 0 || out.base.b < 0) return {base, to_white(base)};
  float largest = 0;
  for (const auto& picture : pictures.lit)
    largest = std::max(largest, std::abs(fit_share(picture[pixel], out.base, out.difference)));
  out.difference = out.difference * largest;
  return out;
}

/// Base and second colour: that of the light, unless another pair is better by more than the tolerance.
ColourPair find_pair(const ViewPictures& pictures, std::size_t pixel, const Radiance& base, float tolerance) {
  const ColourPair white{base, to_white(base)}, other = best_pair(pictures, pixel, base);
  const float gain = squared_errors(pictures, pixel, white.base, white.difference) -
                     squared_errors(pictures, pixel, other.base, other.difference);
  return gain > 3 * static_cast<float>(pictures.lit.size()) * tolerance * tolerance ? other : white;
}

/// The chromaticity of a pixel under the lights that show its own colour most.
Radiance saturated_chromaticity(const ViewPictures& pictures, std::size_t pixel, float brightest,
                                const Radiance& ambient, std::vector<std::pair<float, std::size_t>>& shares) {
  shares.clear();
  for (std::size_t i = 0; i < pictures.lit.size(); ++i) {
    const Radiance& p = pictures.lit[i][pixel];
    if (p.luminance() > kBrightShare * brightest) shares.emplace_back(fit_share(p, ambient, to_white(ambient)), i);
  }
  std::ranges::sort(shares);
  shares.resize(std::max<std::size_t>(1, shares.size() / kSaturatedPart));
  Radiance sum;
  for (const auto& [share, i] : shares) sum += pictures.lit[i][pixel];
  return sum * (1 / sum.luminance());
}

/// Largest c for which U and V of c * colour do not overflow.
float largest_factor(const Radiance& colour) {
  const float y = colour.luminance();
  const float u = std::abs(kUScale * (colour.b - y)), v = std::abs(kVScale * (colour.r - y));
  const float chroma = std::max(u, v);
  return chroma > 0 ? kMaxChroma / chroma : kMaxValue;
}

}  // namespace

Status validate(const ObjectRig& rig, const ViewPictures& pictures) {
  if (const Status valid = rig.validate(); !valid.ok()) return valid;
  const auto pixels = static_cast<std::size_t>(rig.columns) * static_cast<std::size_t>(rig.rows);
  if (pictures.lit.size() < rig.light_positions.size())
    return invalid_argument("the picture of light position " + std::to_string(pictures.lit.size()) +
                            " is missing: " + "a view needs one for each of the " +
                            std::to_string(rig.light_positions.size()) + " positions");
  if (pictures.lit.size() > rig.light_positions.size())
    return invalid_argument("there are " + std::to_string(pictures.lit.size()) + " pictures for " +
                            std::to_string(rig.light_positions.size()) + " light positions");
  if (pictures.coverage.size() != pixels) return size_error("the coverage", pictures.coverage.size(), pixels);
  for (std::size_t i = 0; i < pictures.lit.size(); ++i)
    if (const Status valid =
            check_picture("the picture of light position " + std::to_string(i), pictures.lit[i], pixels);
        !valid.ok())
      return valid;
  return pictures.ambient.empty() ? Status() : check_picture("the ambient picture", pictures.ambient, pixels);
}

Result<ViewFactors> factor_view(const ObjectRig& rig, const ViewPictures& pictures, BaseColor base_color,
                                float tolerance) {
  if (const Status valid = validate(rig, pictures); !valid.ok()) return valid;
  const std::size_t pixels = pictures.coverage.size(), lights = pictures.lit.size();
  ViewFactors out;
  out.base.resize(pixels);
  out.luminance.assign(lights, std::vector<float>(pixels));
  const bool highlights = base_color == BaseColor::highlights;
  out.second.assign(pixels, Radiance{1, 1, 1});
  if (highlights) out.highlight.assign(lights, std::vector<float>(pixels));
  std::vector<std::pair<float, std::size_t>> shares;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    if (pictures.coverage[pixel] == 0) continue;
    float brightest = 0;  // Y_max
    Radiance mean;
    for (const auto& picture : pictures.lit) {
      brightest = std::max(brightest, picture[pixel].luminance());
      mean += picture[pixel];
    }
    if (!(brightest > 0)) continue;
    // H_a; where the ambient picture is black, c has no value, and the mean of the lit pictures takes its place.
    Radiance ambient = pictures.ambient.empty() ? mean : pictures.ambient[pixel];
    if (!(ambient.luminance() > 0)) ambient = mean;
    ambient = ambient * (1 / ambient.luminance());
    const Radiance chromaticity =
        highlights ? saturated_chromaticity(pictures, pixel, brightest, ambient, shares) : ambient;
    const ColourPair pair =
        highlights ? find_pair(pictures, pixel, chromaticity, tolerance) : ColourPair{chromaticity, {}};
    // Here c is relative to the chromaticity of luminance 1: Y_b = c.
    const float limit = largest_factor(pair.base), c = std::min(brightest, limit);
    if (limit < brightest) ++out.reduced;
    out.base[pixel] = pair.base * c;
    for (std::size_t i = 0; i < lights; ++i) out.luminance[i][pixel] = pictures.lit[i][pixel].luminance() / c;
    if (!highlights) continue;
    const Radiance& d = pair.difference;
    out.second[pixel] = pair.base + d;
    // Colours so near to white tell no highlight from the base, unless the pictures are as exact as the tolerance.
    if (d.r * d.r + d.g * d.g + d.b * d.b < kMinSaturation2 * std::min(1.0F, tolerance / kGreyTolerance)) continue;
    for (std::size_t i = 0; i < lights; ++i)
      out.highlight[i][pixel] =
          std::clamp(fit_share(pictures.lit[i][pixel], pair.base, d), -1.0F, 1.0F) * out.luminance[i][pixel];
  }
  return out;
}

}  // namespace lightwell
