#include "field_probes.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include <lightwell/discover.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

constexpr std::chrono::seconds kSearchPeriod{2};
constexpr Duration kSearchTime{500'000'000};

/// Part of the URI up to the first level with a wildcard, without the slash.
std::string broker_of(const std::string& uri) { return uri.substr(0, uri.find("/+")); }

/// Whether a base topic fits the pattern's levels, of which each `+` stands for one.
bool fits(const std::string& uri, const std::string& pattern) {
  std::size_t a = 0, b = 0;
  while (a <= uri.size() && b <= pattern.size()) {
    const std::size_t a_end = std::min(uri.find('/', a), uri.size()),
                      b_end = std::min(pattern.find('/', b), pattern.size());
    const std::string level = pattern.substr(b, b_end - b);
    if (level != "+" && level != uri.substr(a, a_end - a)) return false;
    a = a_end + 1;
    b = b_end + 1;
  }
  return a > uri.size() && b > pattern.size();
}

/// The pattern as the SDK writes URIs: always with the port.
std::string with_port(const std::string& pattern) {
  const std::size_t host = pattern.find("://") + 3, end = std::min(pattern.find('/', host), pattern.size());
  const std::size_t bracket = pattern.find(']', host);
  const std::size_t colon = pattern.find(':', bracket < end ? bracket : host);
  if (colon < end) return pattern;
  return pattern.substr(0, end) + (pattern.starts_with("mqtts") ? ":8883" : ":1883") + pattern.substr(end);
}

}  // namespace

FieldProbes::FieldProbes(const std::vector<std::string>& uris) {
  for (const std::string& uri : uris)
    if (uri.find('+') != std::string::npos && (!uri.starts_with("mqtt") || uri.find("/+") == std::string::npos))
      fail(kUsage, uri + ": a + is a level of a broker's topic, as in mqtt://broker/venue/+");
  search_ = std::thread([this, uris] { search(uris); });
}

FieldProbes::~FieldProbes() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  search_.join();
}

bool FieldProbes::pause() {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, kSearchPeriod, [this] { return stopping_; });
}

void FieldProbes::connect(const std::string& uri) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_ || connections_[uri].probe) return;
  }
  ProbeOptions options;
  options.mqtt = broker_login();
  Result<Probe> probe = Probe::connect(uri, options);
  const std::lock_guard lock(mutex_);
  Connection& connection = connections_[uri];
  if (probe.ok())
    connection.probe = std::make_unique<Probe>(std::move(*probe));
  else
    connection.error = probe.status().message();
}

void FieldProbes::search(std::vector<std::string> uris) {
  const auto is_pattern = [](const std::string& uri) { return uri.find("/+") != std::string::npos; };
  do {
    for (const std::string& uri : uris) {
      if (!is_pattern(uri)) {
        connect(uri);
        continue;
      }
      DiscoverOptions how;
      how.timeout = kSearchTime;
      how.broker = broker_of(uri);
      how.credentials = broker_login();
      const Result<Discovered> found = discover(how);
      if (!found.ok()) {
        const std::lock_guard lock(mutex_);
        connections_[uri].error = found.status().message();
        continue;
      }
      const std::string pattern = with_port(uri);
      std::set<std::string> present;
      std::vector<std::thread> connecting;
      for (const FoundProbe& probe : found->probes)
        for (const FoundLink& link : probe.links)
          if (probe.by == FoundBy::mqtt && !probe.gone && fits(link.uri, pattern) && present.size() < kMaxFieldProbes)
            present.insert(link.uri);
      // A few at a time: each waits for the probe's clock.
      constexpr std::size_t kAtATime = 8;
      for (const std::string& link : present) {
        connecting.emplace_back([this, link] { connect(link); });
        if (connecting.size() < kAtATime) continue;
        for (std::thread& thread : connecting) thread.join();
        connecting.clear();
      }
      for (std::thread& thread : connecting) thread.join();
      // A broker that cannot be searched at this moment says nothing of who has left; one that can still holds the
      // statuses of those that have.
      if (std::ranges::count(found->probes, FoundBy::mqtt, &FoundProbe::by) == 0) continue;
      std::vector<Connection> closing;  // After the lock.
      const std::lock_guard lock(mutex_);
      for (auto it = connections_.begin(); it != connections_.end();) {
        if (!fits(it->first, pattern) || present.contains(it->first)) {
          ++it;
          continue;
        }
        left_.push_back(it->first);
        closing.push_back(std::move(it->second));
        it = connections_.erase(it);
      }
    }
  } while (pause());
}

std::vector<FieldProbes::Absent> FieldProbes::feed(LightField& field) {
  std::vector<Absent> out;
  const std::lock_guard lock(mutex_);
  for (const std::string& name : std::exchange(left_, {})) (void)field.remove(name);
  std::vector<Lighting> newest;
  for (const auto& [uri, connection] : connections_)
    if (connection.probe) newest.push_back(connection.probe->latest());
  const std::optional<HostTime> time = common_time(newest);
  for (auto& [uri, connection] : connections_) {
    const auto absent = [&](const char* state, std::string reason) {
      if (std::exchange(connection.in_field, false)) (void)field.remove(uri);
      out.push_back({uri, state, std::move(reason)});
    };
    if (!connection.probe) {
      absent("unreachable", connection.error.empty() ? "it has not answered yet" : connection.error);
      continue;
    }
    const auto has_estimate = [](const Lighting& l) {
      return l.validity() == Validity::valid || l.validity() == Validity::stale;
    };
    Lighting light = time ? connection.probe->at(*time) : connection.probe->latest();
    if (!has_estimate(light)) light = connection.probe->latest();  // Its first descriptor may be newer.
    if (!has_estimate(light))
      absent("no_light", light.reason());
    else if (light.mounting() == nullptr)
      absent("no_pose", "the probe does not know its pose in the room: lightwelld --mounting");
    else if (const Status s = field.set(uri, field_sample(light, *light.mounting())); !s.ok())
      absent("no_pose", s.message());
    else
      connection.in_field = true;
  }
  return out;
}

}  // namespace lightwell::tool
