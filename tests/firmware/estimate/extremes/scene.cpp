#include "firmware/estimate/extremes/scene.hpp"

#include <cmath>
#include <numbers>

namespace lightwell::extremes {

double Chance::magnitude(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }

Vec3d Chance::direction() {
  const double z = between(-1, 1), azimuth = between(0, 2 * std::numbers::pi), ring = std::sqrt(1 - z * z);
  return {ring * std::cos(azimuth), ring * std::sin(azimuth), z};
}

Quat Chance::rotation() {
  // Shoemake 1992, "Uniform Random Rotations".
  const double u = between(0, 1), a = between(0, 2 * std::numbers::pi), b = between(0, 2 * std::numbers::pi);
  const double p = std::sqrt(1 - u), q = std::sqrt(u);
  return {p * std::sin(a), p * std::cos(a), q * std::sin(b), q * std::cos(b)};
}

Scene constant(Radiance radiance) {
  return {[radiance](Vec3d) { return radiance; }, {}};
}

Scene room(Chance& chance, int most_discs) {
  struct Glow {
    Vec3d axis;
    double sharpness;
    Radiance radiance;
  };
  const auto color = [&](double l) {
    const auto channel = [&] { return static_cast<float>(l * chance.between(0.5, 1)); };
    return Radiance{channel(), channel(), channel()};
  };
  const Radiance sky = color(2), ground = color(0.6), wall = color(1.5);
  const Vec3d zenith = chance.direction(), wall_axis = chance.direction();
  std::vector<Glow> glows;
  for (int i = chance.below(4); i > 0; --i)
    glows.push_back({chance.direction(), chance.between(3, 30), color(chance.magnitude(1, 20))});
  Scene out;
  out.ambient = [=](Vec3d d) {
    const auto up = static_cast<float>(0.5 + 0.5 * std::tanh(6 * dot(d, zenith)));
    const auto near = static_cast<float>(0.5 + 0.5 * std::tanh(12 * (dot(d, wall_axis) - 0.6)));
    Radiance l = sky * up + ground * (1 - up) + wall * near;
    for (const Glow& g : glows) l += g.radiance * static_cast<float>(std::exp(g.sharpness * (dot(d, g.axis) - 1)));
    return l;
  };
  for (int i = chance.below(most_discs + 1); i > 0; --i)
    out.discs.push_back(
        {chance.direction(), chance.between(1, 6) * std::numbers::pi / 180, color(chance.magnitude(30, 3000))});
  return out;
}

Scene turned(const Scene& scene, Quat q) {
  Scene out = scene;
  out.ambient = [ambient = scene.ambient, back = q.inverse()](Vec3d d) { return ambient(rotate(back, d)); };
  for (Disc& disc : out.discs) disc.axis = rotate(q, disc.axis);
  return out;
}

Scene scaled(const Scene& scene, float factor) {
  Scene out = scene;
  out.ambient = [ambient = scene.ambient, factor](Vec3d d) { return ambient(d) * factor; };
  for (Disc& disc : out.discs) disc.radiance = disc.radiance * factor;
  return out;
}

float radiance_times_mean(double times, double radius_rad, float ambient) {
  // mean = ambient + share L and L = times mean - ambient.
  const double share = (1 - std::cos(radius_rad)) / 2;
  return static_cast<float>(ambient * (times - 1) / (1 - times * share));
}

}  // namespace lightwell::extremes
