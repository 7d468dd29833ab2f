// compare_recordings: differences between the light of two recordings of descriptors.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <numbers>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/recording.hpp>

namespace {

using namespace lightwell;

enum Exit : int { kOk = 0, kUsage = 2, kBadInput = 3 };

Result<std::map<std::uint64_t, Descriptor>> descriptors(const std::string& path) {
  Result<RecordReader> reader = RecordReader::open(path);
  if (!reader) return reader.status();
  std::map<std::uint64_t, Descriptor> out;
  Record record;
  while (reader->next(record)) {
    Result<Descriptor> d = decode_descriptor(record.payload);
    if (!d) return d.status();
    out[d->sequence] = std::move(*d);
  }
  return out;
}

bool same(const Light& a, const Light& b) {
  return a.direction == b.direction && a.irradiance.r == b.irradiance.r && a.irradiance.g == b.irradiance.g &&
         a.irradiance.b == b.irradiance.b && a.angular_radius_rad == b.angular_radius_rad;
}

/// Relative RMS difference of irradiance over 2,048 normals and three channels; the reference is `a`.
double irradiance_difference(const Descriptor& a, const Descriptor& b) {
  constexpr int kNormals = 2048;
  const Lighting one = Lighting::of(a), other = Lighting::of(b);
  double difference = 0, whole = 0;
  for (int i = 0; i < kNormals; ++i) {
    const Vec3f n = vec_cast<float>(fibonacci_direction(i, kNormals));
    const Irradiance p = one.irradiance(n).value, q = other.irradiance(n).value;
    for (const auto& [u, v] : {std::pair{p.r, q.r}, {p.g, q.g}, {p.b, q.b}}) {
      difference += std::pow(static_cast<double>(u - v), 2);
      whole += std::pow(static_cast<double>(u), 2);
    }
  }
  return whole > 0 ? std::sqrt(difference / whole) : difference > 0 ? INFINITY : 0;
}

struct Differences {
  std::size_t both = 0, same = 0, unmatched = 0;
  double irradiance = 0, direction_rad = 0;
};

void add(const Descriptor& a, const Descriptor& b, Differences& out) {
  ++out.both;
  bool equal = a.radiance == b.radiance && a.lights.size() == b.lights.size();
  out.unmatched +=
      a.lights.size() > b.lights.size() ? a.lights.size() - b.lights.size() : b.lights.size() - a.lights.size();
  for (const Light& light : a.lights) {
    const auto nearest = std::min_element(b.lights.begin(), b.lights.end(), [&](const Light& p, const Light& q) {
      return dot(p.direction, light.direction) > dot(q.direction, light.direction);
    });
    if (nearest == b.lights.end()) continue;
    equal = equal && same(light, *nearest);
    out.direction_rad = std::max(
        out.direction_rad, angle_between(vec_cast<double>(light.direction), vec_cast<double>(nearest->direction)));
  }
  out.same += equal ? 1 : 0;
  out.irradiance = std::max(out.irradiance, irradiance_difference(a, b));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Compares the light of two recordings of descriptors and prints one JSON object: descriptors with the same "
      "sequence number in both, how many of them are identical, largest relative RMS difference of irradiance over "
      "2,048 normals, largest angle between lights, number of lights that only one has."};
  app.footer("Exit status: 0 compared, 2 wrong usage, 3 invalid input.");
  std::string one, other;
  app.add_option("one", one, "Recording of `lightwell record`")->required();
  app.add_option("other", other, "Recording to compare with")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsage;
  }
  const auto a = descriptors(one), b = descriptors(other);
  for (const auto& [path, read] : {std::pair{&one, &a}, {&other, &b}})
    if (!*read) {
      std::cerr << "compare_recordings: " << *path << ": " << read->status().message() << "\n";
      return kBadInput;
    }
  Differences differences;
  for (const auto& [sequence, descriptor] : *a)
    if (const auto found = b->find(sequence); found != b->end()) add(descriptor, found->second, differences);
  const nlohmann::ordered_json out = {{"one", a->size()},
                                      {"other", b->size()},
                                      {"both", differences.both},
                                      {"same", differences.same},
                                      {"irradiance", differences.irradiance},
                                      {"direction_deg", differences.direction_rad * 180 / std::numbers::pi},
                                      {"unmatched", differences.unmatched}};
  std::cout << out << std::endl;
  return kOk;
}
