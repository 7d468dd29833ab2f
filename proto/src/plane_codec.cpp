#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <lightwell/bytes.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/plane_codec.hpp>

#include "lightwell/v1/captured_plane.pb.h"
#include "messages.hpp"
#include "wire_position.hpp"

namespace lightwell {
namespace {

/// The brightest channel of a tile is scaled to [2^14, 2^15) of RGB9E5's range up to 2^16; entries down to 2^-30 of it
/// have all nine bits.
constexpr int kTileHeadroomBits = 14;

Status invalid_update(const std::string& what) { return invalid_argument("plane update: " + what); }

float largest_channel(const Radiance& v) { return std::max({v.r, v.g, v.b, 0.0F}); }

std::size_t state_bits(PlanePart part) { return part == PlanePart::coverage ? 1 : 2; }

std::size_t state_bytes(PlanePart part, std::size_t entries) { return (entries * state_bits(part) + 7) / 8; }

std::uint32_t state_at(const std::string& packed, std::size_t bits, std::size_t k) {
  const auto byte = static_cast<unsigned char>(packed[k * bits / 8]);
  return static_cast<std::uint32_t>(byte) >> (k * bits % 8) & ((1U << bits) - 1);
}

void put_state(std::string& packed, std::size_t bits, std::size_t k, std::uint32_t state) {
  char& byte = packed[k * bits / 8];
  byte = static_cast<char>(static_cast<unsigned char>(byte) | state << (k * bits % 8));
}

Status read_plane_info(const v1::PlaneUpdate& m, PlaneInfo& info) {
  info.capture = m.capture();
  info.mid_exposure = {static_cast<std::int64_t>(m.mid_exposure_ns())};
  if (m.units() != v1::UNITS_RELATIVE && m.units() != v1::UNITS_ABSOLUTE) return invalid_update("units are not known");
  info.units = static_cast<Units>(m.units());
  info.size_m = m.size_m();
  if (m.has_t_probe_plane()) {
    Result<Pose> pose = wire_pose_from(m.t_probe_plane(), "plane update: T_probe_plane");
    if (!pose) return pose.status();
    info.T_probe_plane = *pose;
  }
  if (m.has_texture_to_plane()) {
    const v1::PlaneSimilarity& s = m.texture_to_plane();
    info.texture_to_plane = {s.x_m(), s.y_m(), s.rotation_rad(), s.scale()};
  }
  if (m.has_gloss_alpha()) info.gloss_alpha = m.gloss_alpha();
  if (m.has_f0()) info.f0 = m.f0();
  return plane_info_problem(info);
}

Status read_plane_tile(const v1::PlaneTile& m, const PlaneUpdate& update, PlaneTile& tile) {
  if (m.index() >= update.layout.size()) return invalid_update("tiles: an index is above that of the last tile");
  tile.index = m.index();
  if (update.tile_revision[tile.index] == 0) return invalid_update("tiles: a tile whose revision is 0");
  const PlanePart part = update.layout.part(tile.index);
  const std::size_t entries = update.layout.entries(tile.index), bits = state_bits(part);
  const bool coverage = part == PlanePart::coverage;
  if (m.exponent() < kMinEnvironmentExponent || m.exponent() > kMaxEnvironmentExponent ||
      (coverage && m.exponent() != 0))
    return invalid_update("tiles: exponent is out of range");
  if (m.values().size() != (coverage ? 0 : 4 * entries))
    return invalid_update("tiles: the length of values does not match the tile");
  if (m.states().size() != state_bytes(part, entries))
    return invalid_update("tiles: the length of states does not match the tile");
  for (std::size_t k = entries; k < m.states().size() * 8 / bits; ++k)
    if (state_at(m.states(), bits, k) != 0) return invalid_update("tiles: unused bits of states are not 0");
  tile.state.resize(entries);
  for (std::size_t k = 0; k < entries; ++k) {
    const std::uint32_t state = state_at(m.states(), bits, k);
    if (state > static_cast<std::uint32_t>(SampleState::clipped)) return invalid_update("tiles: a state is not known");
    tile.state[k] = static_cast<SampleState>(state);
  }
  tile.radiance.resize(m.values().size() / 4);
  for (std::size_t k = 0; k < tile.radiance.size(); ++k)
    tile.radiance[k] = texel_radiance(get_le<std::uint32_t>(&m.values()[4 * k]), m.exponent());
  return {};
}

/// What a reader has of a tile, once all messages have arrived.
struct SentTile {
  std::uint64_t revision = 0;  ///< 0: nothing was sent.
  ProbeTime time;              ///< When it was sent last.
  int exponent = 0;
  std::string values, states;  ///< As in PlaneTile of the wire.
};

/// The entries of one tile of a plane.
class TileSource {
 public:
  TileSource(const CapturedPlane& plane, const PlaneTileLayout& layout, std::size_t tile)
      : plane_(plane), layout_(layout), tile_(tile), part_(layout.part(tile)), entries_(layout.entries(tile)) {}

  [[nodiscard]] PlanePart part() const { return part_; }
  [[nodiscard]] std::size_t entries() const { return entries_; }
  [[nodiscard]] Radiance radiance(std::size_t k) const {
    const std::size_t at = layout_.entry(tile_, k);
    return part_ == PlanePart::texture ? plane_.texture.radiance[at] : plane_.lumisphere.radiance[at];
  }
  [[nodiscard]] std::uint32_t state(std::size_t k) const {
    const std::size_t at = layout_.entry(tile_, k);
    if (part_ == PlanePart::coverage) return plane_.coverage.seen[at] != 0 ? 1 : 0;
    return static_cast<std::uint32_t>(part_ == PlanePart::texture ? plane_.texture.state[at]
                                                                  : plane_.lumisphere.state[at]);
  }
  [[nodiscard]] float largest() const {
    float out = 0;
    for (std::size_t k = 0; k < entries_; ++k) out = std::max(out, largest_channel(radiance(k)));
    return out;
  }

 private:
  const CapturedPlane& plane_;
  const PlaneTileLayout& layout_;
  std::size_t tile_;
  PlanePart part_;
  std::size_t entries_;
};

bool differs(const SentTile& sent, const TileSource& now, float step) {
  const std::size_t bits = state_bits(now.part());
  for (std::size_t k = 0; k < now.entries(); ++k)
    if (state_at(sent.states, bits, k) != now.state(k)) return true;
  if (now.part() == PlanePart::coverage) return false;
  const float least = PlaneEncoder::kMinRelativeEntry * now.largest();
  for (std::size_t k = 0; k < now.entries(); ++k) {
    const Radiance held = texel_radiance(get_le<std::uint32_t>(&sent.values[4 * k]), sent.exponent);
    const Radiance v = now.radiance(k);
    const float tolerance = step * std::max(largest_channel(v), least);
    for (int c = 0; c < 3; ++c)
      if (std::abs(std::max(v[c], 0.0F) - held[c]) > tolerance) return true;
  }
  return false;
}

void pack(const TileSource& now, SentTile& sent) {
  const std::size_t bits = state_bits(now.part());
  std::ranges::fill(sent.states, '\0');
  for (std::size_t k = 0; k < now.entries(); ++k) put_state(sent.states, bits, k, now.state(k));
  if (now.part() == PlanePart::coverage) return;
  const float most = now.largest();
  sent.exponent =
      most > 0 ? std::clamp(std::ilogb(most) - kTileHeadroomBits, kMinEnvironmentExponent, kMaxEnvironmentExponent) : 0;
  const auto scaled = [&](float v) { return std::ldexp(v, -sent.exponent); };
  for (std::size_t k = 0; k < now.entries(); ++k) {
    const Radiance v = now.radiance(k);
    put_le(&sent.values[4 * k], rgb9e5_encode(scaled(v.r), scaled(v.g), scaled(v.b)));
  }
}

void fill_plane_header(const PlaneInfo& info, const PlaneTileLayout& layout, v1::PlaneUpdate& m) {
  m.set_wire_version(kPlaneWireVersion);
  m.set_capture(info.capture);
  m.set_mid_exposure_ns(static_cast<std::uint64_t>(info.mid_exposure.ns));
  m.set_units(static_cast<v1::Units>(info.units));
  m.set_size_m(info.size_m);
  m.clear_t_probe_plane();
  if (info.T_probe_plane) fill_pose(*info.T_probe_plane, *m.mutable_t_probe_plane());
  v1::PlaneSimilarity& s = *m.mutable_texture_to_plane();
  s.set_x_m(info.texture_to_plane.x_m);
  s.set_y_m(info.texture_to_plane.y_m);
  s.set_rotation_rad(info.texture_to_plane.rotation_rad);
  s.set_scale(info.texture_to_plane.scale);
  m.clear_gloss_alpha();
  m.clear_f0();
  if (info.gloss_alpha) m.set_gloss_alpha(*info.gloss_alpha);
  if (info.f0) m.set_f0(*info.f0);
  m.set_texture_edge(static_cast<std::uint32_t>(layout.texture_edge()));
  m.set_lumisphere_levels(static_cast<std::uint32_t>(layout.lumisphere_levels()));
  m.set_coverage_levels(static_cast<std::uint32_t>(layout.coverage_levels()));
}

/// Upper bound of the bytes of a tile in a message: tags, lengths, index and exponent take less than 32.
std::size_t tile_bytes(const SentTile& tile) { return 32 + tile.values.size() + tile.states.size(); }

}  // namespace

Result<PlaneUpdate> decode_plane_update(std::span<const std::byte> bytes) {
  if (bytes.size() > kMaxPlaneMessageBytes) return Status(StatusCode::data_loss, "plane update: longer than 64 KiB");
  v1::PlaneUpdate m;
  if (!m.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return Status(StatusCode::data_loss, "plane update: not a protobuf message");
  if (m.wire_version() != kPlaneWireVersion)
    return invalid_update("wire_version is " + std::to_string(m.wire_version()) + ", this reader knows 1");
  PlaneUpdate out;
  if (Status s = read_plane_info(m, out.info); !s.ok()) return s;
  out.revision = m.revision();
  if (out.revision == 0) return invalid_update("revision is 0");
  if (m.key_interval_ms() == 0) return invalid_update("key_interval_ms is 0");
  out.key_interval = {std::int64_t{m.key_interval_ms()} * 1'000'000};
  if (m.texture_edge() > static_cast<std::uint32_t>(kMaxPlaneTextureEdge))
    return invalid_update("texture_edge is above 256");
  const auto levels_ok = [](std::uint32_t levels) {
    return levels >= 1 && levels <= static_cast<std::uint32_t>(kMaxPlaneLevels);
  };
  if (!levels_ok(m.lumisphere_levels())) return invalid_update("lumisphere_levels must be 1 to 128");
  if (!levels_ok(m.coverage_levels())) return invalid_update("coverage_levels must be 1 to 128");
  out.layout = {static_cast<int>(m.texture_edge()), static_cast<int>(m.lumisphere_levels()),
                static_cast<int>(m.coverage_levels())};
  if (static_cast<std::size_t>(m.tile_revision_size()) != out.layout.size())
    return invalid_update("tile_revision has not one number for each tile");
  out.tile_revision.assign(m.tile_revision().begin(), m.tile_revision().end());
  if (std::ranges::any_of(out.tile_revision, [&](std::uint64_t r) { return r > out.revision; }))
    return invalid_update("tile_revision: a number is above revision");
  if (static_cast<std::size_t>(m.tiles_size()) > out.layout.size()) return invalid_update("tiles: one comes twice");
  std::vector<bool> present(out.layout.size());
  out.tiles.resize(static_cast<std::size_t>(m.tiles_size()));
  for (int i = 0; i < m.tiles_size(); ++i) {
    PlaneTile& tile = out.tiles[static_cast<std::size_t>(i)];
    if (Status s = read_plane_tile(m.tiles(i), out, tile); !s.ok()) return s;
    if (present[tile.index]) return invalid_update("tiles: one comes twice");
    present[tile.index] = true;
  }
  return out;
}

struct PlaneEncoder::State {
  PlaneEncoderOptions options;
  std::uint32_t capture = 0;
  std::uint64_t revision = 0;
  PlaneTileLayout layout;
  std::vector<SentTile> tiles;
  v1::PlaneUpdate message;
  std::vector<std::vector<std::byte>> messages;  ///< Of all updates so far; the first `used` are of this one.
  std::size_t used = 0;

  void start(std::uint32_t number, const PlaneTileLayout& now) {
    capture = number;
    layout = now;
    tiles.assign(layout.size(), {});
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      const PlanePart part = layout.part(t);
      tiles[t].values.assign(part == PlanePart::coverage ? 0 : 4 * layout.entries(t), '\0');
      tiles[t].states.assign(state_bytes(part, layout.entries(t)), '\0');
    }
  }

  /// Messages with the header that `message` has, and the tiles with content for which `due` is true.
  template <class Due>
  std::span<const std::vector<std::byte>> write_messages(const Due& due) {
    used = 0;
    const std::size_t header = message.ByteSizeLong();
    std::size_t size = header;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      SentTile& tile = tiles[t];
      if (tile.revision == 0 || !due(tile)) continue;
      if (size + tile_bytes(tile) > kMaxPlaneMessageBytes) {
        write_message();
        size = header;
      }
      v1::PlaneTile& out = *message.add_tiles();
      out.set_index(static_cast<std::uint32_t>(t));
      out.set_exponent(tile.exponent);
      out.set_values(tile.values);
      out.set_states(tile.states);
      size += tile_bytes(tile);
    }
    if (used == 0 || message.tiles_size() > 0) write_message();
    return {messages.data(), used};
  }

 private:
  void write_message() {
    if (used == messages.size()) messages.emplace_back();
    std::vector<std::byte>& out = messages[used++];
    out.resize(message.ByteSizeLong());
    message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(out.data()));
    message.clear_tiles();
  }
};

PlaneEncoder::PlaneEncoder(const PlaneEncoderOptions& options) : state_(std::make_unique<State>()) {
  state_->options = options;
  // The comparison is also false for NaN.
  state_->options.step = options.step >= 1.0F / 256 ? options.step : 1.0F / 256;
  state_->options.key_interval = {
      std::clamp(options.key_interval.ns, std::int64_t{1'000'000}, std::int64_t{1'000'000'000'000})};
}
PlaneEncoder::~PlaneEncoder() = default;
PlaneEncoder::PlaneEncoder(PlaneEncoder&&) noexcept = default;
PlaneEncoder& PlaneEncoder::operator=(PlaneEncoder&&) noexcept = default;

Result<std::span<const std::vector<std::byte>>> PlaneEncoder::encode(const CapturedPlane& plane, ProbeTime now) {
  if (Status s = captured_plane_problem(plane); !s.ok()) return s;
  State& state = *state_;
  const int edge = state.options.images == ImageRecipients::all_clients ? plane.texture.edge : 0;
  const PlaneTileLayout layout(edge, plane.lumisphere.grid.levels(), plane.coverage.grid.levels());
  if (plane.info.capture != state.capture)
    state.start(plane.info.capture, layout);
  else if (layout != state.layout)
    return Status(StatusCode::failed_precondition, "captured plane: other sizes need another capture number");
  ++state.revision;
  v1::PlaneUpdate& m = state.message;
  m.clear_tile_revision();
  m.clear_tiles();
  for (std::size_t t = 0; t < state.tiles.size(); ++t) {
    const TileSource source(plane, state.layout, t);
    SentTile& tile = state.tiles[t];
    if (differs(tile, source, state.options.step)) {
      pack(source, tile);
      tile.revision = state.revision;
    }
    m.add_tile_revision(tile.revision);
  }
  fill_plane_header(plane.info, state.layout, m);
  m.set_revision(state.revision);
  m.set_key_interval_ms(static_cast<std::uint32_t>(state.options.key_interval.ns / 1'000'000));

  return state.write_messages([&](SentTile& tile) {
    const bool key_due = now < tile.time || now - tile.time >= state.options.key_interval;
    if (tile.revision != state.revision && !key_due) return false;
    tile.time = now;
    return true;
  });
}

std::span<const std::vector<std::byte>> PlaneEncoder::whole() {
  if (state_->revision == 0) return {};
  return state_->write_messages([](const SentTile&) { return true; });
}

}  // namespace lightwell
