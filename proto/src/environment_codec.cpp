#include "environment_codec.hpp"

#include <string>

namespace lightwell {
namespace {

Status invalid_map(const std::string& what) {
  return {StatusCode::invalid_argument, "descriptor: environment." + what};
}

Status problem_of_whole(const EnvironmentMap& map) {
  if (map.levels.size() > kMaxEnvironmentLevels) return invalid_map("levels: there are more than 8");
  for (std::size_t k = 0; k < map.levels.size(); ++k) {
    const EnvironmentLevel& level = map.levels[k];
    if (level.edge < 0 || !is_environment_edge(static_cast<std::uint64_t>(level.edge)))
      return invalid_map("levels: an edge must be 8, 16, 32 or 64");
    if (!(level.roughness >= 0 && level.roughness <= 1)) return invalid_map("levels: a roughness must be 0 to 1");
    if (k == 0) continue;
    if (level.edge > map.levels[k - 1].edge) return invalid_map("levels: an edge is larger than the one before");
    if (!(level.roughness > map.levels[k - 1].roughness)) return invalid_map("levels: roughness must increase");
  }
  const std::size_t count = texel_count(map.levels);
  if (count > kMaxEnvironmentTexels) return invalid_map("levels have more than 8192 texels");
  if (map.texels.size() != count) return invalid_map("texels: the length does not match the levels");
  if (map.exponent < kMinEnvironmentExponent || map.exponent > kMaxEnvironmentExponent)
    return invalid_map("exponent is out of range");
  if (!map.runs.empty()) return invalid_map("runs: not allowed in a whole map");
  if (map.key != environment_key(map)) return invalid_map("key does not match the content of the map");
  return {};
}

Status problem_of_changes(const EnvironmentMap& map) {
  if (map.exponent != 0) return invalid_map("exponent: not allowed in changes");
  if (map.key_interval_ms != 0) return invalid_map("key_interval_ms: not allowed in changes");
  if (map.runs.size() % 2 != 0) return invalid_map("runs: the number is odd; they are pairs");
  std::uint64_t reach = 0, taken = 0;
  for (std::size_t k = 0; k < map.runs.size(); ++k) {
    // Canonical form: only the first run may be empty.
    if (map.runs[k] == 0 && k > 0) return invalid_map("runs: one is empty");
    reach += map.runs[k];
    if (k % 2 == 1) taken += map.runs[k];
    if (reach > kMaxEnvironmentTexels) return invalid_map("runs: they exceed the size of any map");
  }
  if (map.texels.size() != taken) return invalid_map("texels: the length does not match the runs");
  return {};
}

}  // namespace

Status environment_problem(const EnvironmentMap& map) {
  if (map.key == 0) return invalid_map("key is 0");
  return map.whole() ? problem_of_whole(map) : problem_of_changes(map);
}

void reserve_environment(v1::EnvironmentMap& m) {
  for (std::size_t k = 0; k < kMaxEnvironmentLevels; ++k) m.add_levels();
  m.mutable_texels()->reserve(4 * kMaxEnvironmentTexels);
  m.mutable_runs()->Reserve(static_cast<int>(kMaxEnvironmentTexels));
  m.Clear();
}

void fill_environment(const EnvironmentMap& map, v1::EnvironmentMap& m) {
  m.Clear();
  m.set_key(map.key);
  m.set_encoding(v1::EnvironmentMap::RGB9E5);
  for (const EnvironmentLevel& level : map.levels) {
    v1::EnvironmentMap::Level& out = *m.add_levels();
    out.set_edge(static_cast<std::uint32_t>(level.edge));
    out.set_roughness(level.roughness);
  }
  m.set_exponent(map.exponent);
  m.set_key_interval_ms(map.key_interval_ms);
  std::string& texels = *m.mutable_texels();
  texels.resize(4 * map.texels.size());
  std::size_t at = 0;
  for (const std::uint32_t v : map.texels)
    for (int k = 0; k < 4; ++k) texels[at++] = static_cast<char>(v >> (8 * k) & 255U);
  m.mutable_runs()->Add(map.runs.begin(), map.runs.end());
}

Status read_environment(const v1::EnvironmentMap& m, EnvironmentMap& map) {
  if (m.encoding() != v1::EnvironmentMap::RGB9E5) return invalid_map("encoding is not known");
  if (m.texels().size() % 4 != 0) return invalid_map("texels: the length is not a multiple of 4 bytes");
  map.key = m.key();
  map.levels.clear();
  for (const v1::EnvironmentMap::Level& level : m.levels()) {
    if (!is_environment_edge(level.edge())) return invalid_map("levels: an edge must be 8, 16, 32 or 64");
    map.levels.push_back({static_cast<int>(level.edge()), level.roughness()});
  }
  map.exponent = m.exponent();
  map.key_interval_ms = m.key_interval_ms();
  map.texels.resize(m.texels().size() / 4);
  for (std::size_t i = 0; i < map.texels.size(); ++i) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 4; ++k)
      v |= static_cast<std::uint32_t>(static_cast<unsigned char>(m.texels()[4 * i + k])) << (8 * k);
    map.texels[i] = v;
  }
  map.runs.assign(m.runs().begin(), m.runs().end());
  return {};
}

}  // namespace lightwell
