#include "field/match.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "field/triangulate.hpp"

namespace lightwell::field {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kNeighbours = 6;      // Views that a view forms pairs with: the nearest ones.
constexpr std::size_t kLightsInPairs = 12;  // The strongest of a view form pairs; weaker ones extend them.
constexpr double kGate = 16;                // Squared Mahalanobis distance of an observation from a hypothesis.
// Standard deviation of the logarithm of irradiance times squared distance: lamps are not isotropic, and caps hold
// light from around the lamp. Of unrelated lights: kUnrelated.
constexpr double kIntensitySigma = 0.5, kUnrelatedIntensity = 1.5;
constexpr double kChromaSigma = 0.15, kUnrelatedChroma = 0.35;
constexpr double kMissing = 1.5;      // For a view that should see the light and has none there.
constexpr double kSmallestScore = 4;  // Below, the light is taken as unmatched.
constexpr double kAmbiguousMargin = 2;

struct Range {
  std::size_t first = 0, last = 0;
};

struct Hypothesis {
  std::vector<std::size_t> members;
  std::optional<Triangulation> point;  // Otherwise distant.
  Vec3d direction;
  double score = 0;
};

class Matcher {
 public:
  Matcher(std::span<const ProbeView> views, std::span<const Observation> observations)
      : views_(views), observations_(observations), ranges_(views.size()), used_(observations.size()) {
    for (std::size_t v = 0, i = 0; v < views.size(); ++v) {
      ranges_[v].first = i;
      while (i < observations.size() && observations[i].view == v) ++i;
      ranges_[v].last = i;
    }
  }

  LightMatches match();

 private:
  [[nodiscard]] std::vector<Hypothesis> pairs() const;
  [[nodiscard]] std::optional<Hypothesis> pair(std::size_t i, std::size_t j) const;
  /// Adds the best free observation of each other view.
  void extend(Hypothesis& hypothesis) const;
  [[nodiscard]] double appearance_gain(const Hypothesis& hypothesis, std::size_t candidate) const;
  /// Radiant intensity of the members, or irradiance of a distant light.
  [[nodiscard]] double strength(const Hypothesis& hypothesis, std::size_t i) const;
  [[nodiscard]] bool scale_known(std::size_t i, std::size_t j) const {
    const ProbeView &a = views_[observations_[i].view], &b = views_[observations_[j].view];
    return a.calibration == b.calibration || (a.scale_known && b.scale_known);
  }
  [[nodiscard]] std::size_t count(std::size_t view) const { return ranges_[view].last - ranges_[view].first; }
  [[nodiscard]] bool ambiguous(const Hypothesis& hypothesis, std::span<const Hypothesis> all) const;

  std::span<const ProbeView> views_;
  std::span<const Observation> observations_;
  std::vector<Range> ranges_;
  std::vector<bool> used_;
};

double Matcher::strength(const Hypothesis& hypothesis, std::size_t i) const {
  const Observation& o = observations_[i];
  if (!hypothesis.point) return o.luminance;
  const Vec3d to = hypothesis.point->point - o.origin;
  return o.luminance * dot(to, to);
}

double gain(double squared_difference, double sigma, double unrelated, int dimensions) {
  return dimensions * std::log(unrelated / sigma) -
         squared_difference * (1 / (sigma * sigma) - 1 / (unrelated * unrelated)) / 2;
}

double Matcher::appearance_gain(const Hypothesis& hypothesis, std::size_t candidate) const {
  double sum = 0;
  std::size_t known = 0;
  std::array<double, 2> chroma{};
  for (const std::size_t m : hypothesis.members) {
    for (std::size_t c = 0; c < 2; ++c)
      chroma[c] += observations_[m].chroma[c] / static_cast<double>(hypothesis.members.size());
    if (!scale_known(m, candidate)) continue;
    sum += std::log(strength(hypothesis, m));
    ++known;
  }
  const auto& own = observations_[candidate].chroma;
  const double c0 = own[0] - chroma[0], c1 = own[1] - chroma[1];
  double out = gain(c0 * c0 + c1 * c1, kChromaSigma, kUnrelatedChroma, 2);
  if (known > 0) {
    const double difference = std::log(strength(hypothesis, candidate)) - sum / static_cast<double>(known);
    out += gain(difference * difference, kIntensitySigma, kUnrelatedIntensity, 1);
  }
  return out;
}

std::optional<Hypothesis> Matcher::pair(std::size_t i, std::size_t j) const {
  const Observation &a = observations_[i], &b = observations_[j];
  Hypothesis out;
  out.members = {i, j};
  const double angle = angle_between(a.direction, b.direction);
  const double parallel = std::hypot(a.sigma_rad, b.sigma_rad);
  const double lights = static_cast<double>(std::max(count(a.view), count(b.view)));
  double chi2 = 0, width = 0;
  out.point = angle > 2 * parallel ? triangulate(observations_, out.members) : std::nullopt;
  if (out.point) {
    const Vec3d normal = normalized(cross(a.direction, b.direction));
    const double ta = length(out.point->point - a.origin), tb = length(out.point->point - b.origin);
    const double miss = dot(b.origin - a.origin, normal);
    const double sigma = std::hypot(a.sigma_rad * ta, b.sigma_rad * tb);
    chi2 = miss * miss / (sigma * sigma);
    // One dimension: across the plane of the baseline and a ray. Half of the unrelated rays meet behind.
    width = lights * std::sqrt(2 * kPi) * sigma / (4 * std::max(ta, tb));
  } else if (angle < 3 * parallel) {
    out.direction = normalized(a.direction + b.direction);
    chi2 = angle * angle / (parallel * parallel);
    width = lights * parallel * parallel / 2;  // n 2 pi sigma² / 4 pi
  } else {
    return std::nullopt;
  }
  if (chi2 > kGate) return std::nullopt;
  Hypothesis first = out;
  first.members = {i};
  out.score = -std::log(std::max(width, 1e-9)) - chi2 / 2 + appearance_gain(first, j);
  return out;
}

void Matcher::extend(Hypothesis& hypothesis) const {
  const std::vector<std::size_t> seed = hypothesis.members;
  double strongest = 0;
  for (const std::size_t m : seed) strongest += strength(hypothesis, m) / static_cast<double>(seed.size());
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (std::ranges::any_of(seed, [&](std::size_t m) { return observations_[m].view == v; })) continue;
    const Vec3d to = hypothesis.point ? hypothesis.point->point - views_[v].origin : hypothesis.direction;
    const double gap = hypothesis.point ? length(to) : 1;
    if (!(gap > 1e-6)) continue;
    const Vec3d expected = to * (1 / gap);
    double best = 0;
    std::size_t chosen = observations_.size();
    for (std::size_t i = ranges_[v].first; i < ranges_[v].last; ++i) {
      if (used_[i] || dot(observations_[i].direction, expected) < 0.8) continue;
      const Vec3d miss = observations_[i].direction - expected;
      // Innovation covariance in two tangents.
      const auto [u, w] = tangent_basis(expected);
      const double own = observations_[i].sigma_rad * observations_[i].sigma_rad;
      double uu = own, uw = 0, ww = own;
      if (hypothesis.point) {
        const double k = 1 / (gap * gap);
        uu += k * quadratic(hypothesis.point->covariance, u, u);
        uw += k * quadratic(hypothesis.point->covariance, u, w);
        ww += k * quadratic(hypothesis.point->covariance, w, w);
      }
      const double det = uu * ww - uw * uw, mu = dot(miss, u), mw = dot(miss, w);
      if (!(det > 0)) continue;
      const double chi2 = (ww * mu * mu - 2 * uw * mu * mw + uu * mw * mw) / det;
      if (chi2 > kGate) continue;
      const double width = static_cast<double>(count(v)) * std::sqrt(det) / 2;
      const double score = -std::log(std::max(width, 1e-9)) - chi2 / 2 + appearance_gain(hypothesis, i);
      if (score > best) best = score, chosen = i;
    }
    if (chosen < observations_.size()) {
      hypothesis.members.push_back(chosen);
      hypothesis.score += best;
      continue;
    }
    // A view lists its strongest lights: a stronger one than its weakest should be among them.
    const bool comparable = scale_known(seed[0], ranges_[v].first < ranges_[v].last ? ranges_[v].first : seed[0]);
    const double weakest = count(v) > 0 ? observations_[ranges_[v].last - 1].luminance : 0;
    if (comparable && strongest / (gap * gap) > 2 * weakest) hypothesis.score -= kMissing;
  }
}

std::vector<Hypothesis> Matcher::pairs() const {
  std::vector<Hypothesis> out;
  for (std::size_t a = 0; a < views_.size(); ++a) {
    std::vector<std::size_t> others;
    for (std::size_t b = 0; b < views_.size(); ++b)
      if (b != a) others.push_back(b);
    std::ranges::sort(others, {}, [&](std::size_t b) { return length(views_[b].origin - views_[a].origin); });
    for (std::size_t n = 0; n < std::min(others.size(), kNeighbours); ++n) {
      const std::size_t b = others[n];
      for (std::size_t i = ranges_[a].first; i < std::min(ranges_[a].last, ranges_[a].first + kLightsInPairs); ++i)
        for (std::size_t j = ranges_[b].first; j < std::min(ranges_[b].last, ranges_[b].first + kLightsInPairs); ++j) {
          // A pair of neighbours comes up from both sides.
          if (auto made = pair(std::min(i, j), std::max(i, j))) out.push_back(std::move(*made));
        }
    }
  }
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!(observations_[i].distance_m > 0)) continue;
    Hypothesis one;
    one.members = {i};
    one.point = triangulate(observations_, one.members);
    one.score = kSmallestScore;
    if (one.point) out.push_back(std::move(one));
  }
  return out;
}

/// Two observations alone do not tell which of two similar lights in a plane with both probes they are: another partner
/// is nearly as good, and is in no better group itself.
bool Matcher::ambiguous(const Hypothesis& hypothesis, std::span<const Hypothesis> all) const {
  if (hypothesis.members.size() != 2) return false;
  const auto& m = hypothesis.members;
  for (const Hypothesis& other : all) {
    if (other.score < hypothesis.score - kAmbiguousMargin) break;  // By falling score.
    if (other.members.size() != 2 || other.members == m) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      if (other.members[k] != m[k]) continue;
      const std::size_t rival = other.members[1 - k];
      if (used_[rival] || observations_[rival].view != observations_[m[1 - k]].view) continue;
      // The rival's own best partner, if that is clearly better, decides.
      double best = -1e9;
      for (const Hypothesis& third : all)
        if (std::ranges::find(third.members, rival) != third.members.end() &&
            std::ranges::find(third.members, m[k]) == third.members.end())
          best = std::max(best, third.score);
      if (best < other.score + kAmbiguousMargin) return true;
    }
  }
  return false;
}

LightMatches Matcher::match() {
  LightMatches out;
  std::vector<Hypothesis> all = pairs();
  for (Hypothesis& h : all) {
    if (h.members.size() < 2) continue;
    const double alone = h.score;
    extend(h);
    if (h.members.size() > 2) continue;
    h.score = std::min(h.score, alone);
  }
  const auto by_score = [](const Hypothesis& a, const Hypothesis& b) {
    return a.score != b.score ? a.score > b.score : a.members < b.members;
  };
  std::ranges::sort(all, by_score);
  for (std::size_t n = 0; n < all.size() && all[n].score >= kSmallestScore; ++n) {
    Hypothesis& h = all[n];
    if (std::ranges::any_of(h.members, [&](std::size_t m) { return used_[m]; })) {
      // Its pair may still be free: it takes its place in the order anew.
      if (h.members.size() <= 2 || used_[h.members[0]] || used_[h.members[1]]) continue;
      auto again = pair(h.members[0], h.members[1]);
      if (!again) continue;
      extend(*again);
      const auto place =
          std::ranges::upper_bound(all.begin() + static_cast<std::ptrdiff_t>(n) + 1, all.end(), *again, by_score);
      all.insert(place, std::move(*again));
      continue;
    }
    if (ambiguous(h, all)) {
      for (const std::size_t m : h.members)
        if (std::ranges::find(out.ambiguous, m) == out.ambiguous.end()) out.ambiguous.push_back(m);
      continue;
    }
    for (const std::size_t m : h.members) used_[m] = true;
    out.groups.push_back(h.members);
  }
  std::erase_if(out.ambiguous, [&](std::size_t m) { return used_[m]; });
  return out;
}

}  // namespace

LightMatches match_lights(std::span<const ProbeView> views, std::span<const Observation> observations) {
  return Matcher(views, observations).match();
}

}  // namespace lightwell::field
