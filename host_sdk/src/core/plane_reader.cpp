#include <algorithm>
#include <string>
#include <utility>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>

#include "core/plane_state.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kFormerCaptures = 4;

Status contradiction(const std::string& what) { return invalid_argument("plane update: " + what); }

std::unique_ptr<core::PlaneState> empty_state(const PlaneUpdate& update) {
  auto out = std::make_unique<core::PlaneState>();
  out->layout = update.layout;
  out->listed.assign(update.layout.size(), 0);
  out->held.assign(update.layout.size(), 0);
  PlaneTexture& texture = out->plane.texture;
  texture.edge = update.layout.texture_edge();
  texture.radiance.resize(texture.count());
  texture.state.resize(texture.count());
  PlaneLumisphere& lumisphere = out->plane.lumisphere;
  lumisphere.grid = HemisphereGrid(update.layout.lumisphere_levels());
  lumisphere.radiance.resize(lumisphere.grid.size());
  lumisphere.state.resize(lumisphere.grid.size());
  PlaneCoverage& coverage = out->plane.coverage;
  coverage.grid = HemisphereGrid(update.layout.coverage_levels());
  coverage.seen.resize(coverage.grid.size());
  return out;
}

/// Revisions of tiles never fall from one update to the next.
Status order_problem(const core::PlaneState& held, const PlaneUpdate& update) {
  if (update.layout != held.layout) return contradiction("other sizes than before in the same capture");
  const bool newer = update.revision > held.revision;
  for (std::size_t t = 0; t < held.listed.size(); ++t) {
    const std::uint64_t a = newer ? held.listed[t] : update.tile_revision[t];
    const std::uint64_t b = newer ? update.tile_revision[t] : held.listed[t];
    if (a > b || (update.revision == held.revision && a != b))
      return contradiction("tile_revision contradicts an earlier message");
    // What changed after an update is not in that update.
    if (a != b && b <= std::min(held.revision, update.revision))
      return contradiction("tile_revision contradicts an earlier message");
  }
  return {};
}

void store(const PlaneTile& tile, core::PlaneState& state) {
  const PlanePart part = state.layout.part(tile.index);
  for (std::size_t k = 0; k < tile.state.size(); ++k) {
    const std::size_t at = state.layout.entry(tile.index, k);
    switch (part) {
      case PlanePart::texture:
        state.plane.texture.radiance[at] = tile.radiance[k];
        state.plane.texture.state[at] = tile.state[k];
        break;
      case PlanePart::lumisphere:
        state.plane.lumisphere.radiance[at] = tile.radiance[k];
        state.plane.lumisphere.state[at] = tile.state[k];
        break;
      case PlanePart::coverage:
        state.plane.coverage.seen[at] = tile.state[k] == SampleState::unseen ? 0 : 1;
        break;
    }
  }
}

}  // namespace

PlaneReader::PlaneReader() = default;
PlaneReader::~PlaneReader() = default;
PlaneReader::PlaneReader(PlaneReader&&) noexcept = default;
PlaneReader& PlaneReader::operator=(PlaneReader&&) noexcept = default;

Status PlaneReader::take(std::span<const std::byte> message, HostTime received) {
  return take_update(decode_plane_update(message), received);
}

Status PlaneReader::take_update(const Result<PlaneUpdate>& update, HostTime received) {
  Status problem = update.status();
  const bool begins = problem.ok() && (!state_ || update->info.capture != state_->plane.info.capture);
  if (begins && std::ranges::find(former_captures_, update->info.capture) != former_captures_.end())
    problem = contradiction("of a former capture");
  if (problem.ok() && !begins) problem = order_problem(*state_, *update);
  if (!problem.ok()) {
    ++stats_.refused;
    return problem;
  }
  ++stats_.messages;
  published_.reset();
  if (begins) {
    if (state_) former_captures_.push_back(state_->plane.info.capture);
    if (former_captures_.size() > kFormerCaptures) former_captures_.erase(former_captures_.begin());
    state_ = empty_state(*update);
  }
  core::PlaneState& state = *state_;
  state.received = std::max(state.received, received);
  if (update->revision > state.revision) {
    state.plane.info = update->info;
    state.revision = update->revision;
    state.key_interval = update->key_interval;
    state.listed = update->tile_revision;
  }
  for (const PlaneTile& tile : update->tiles) {
    const std::uint64_t revision = update->tile_revision[tile.index];
    if (revision != state.listed[tile.index] || revision == state.held[tile.index]) {
      ++stats_.tiles_unused;
      continue;
    }
    ++stats_.tiles;
    store(tile, state);
    state.held[tile.index] = revision;
  }
  state.missing = 0;
  for (std::size_t t = 0; t < state.held.size(); ++t) state.missing += state.held[t] != state.listed[t] ? 1 : 0;
  return {};
}

bool PlaneReader::complete() const { return state_ && state_->missing == 0; }

std::shared_ptr<const core::PlaneState> PlaneReader::state() {
  if (state_ && !published_) published_ = std::make_shared<const core::PlaneState>(*state_);
  return published_;
}

PlaneAppearance PlaneReader::snapshot(HostTime now) { return {state(), now}; }

}  // namespace lightwell
