#include "light_source.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <string>

namespace lightwell::xr {
namespace {

using std::chrono::milliseconds;

/// Pauses between attempts to connect for the first time; they double. A probe that is switched on late is found within
/// the longest one.
constexpr milliseconds kFirstPause{250}, kMaxPause{4'000};
/// How often the mounting and the link's state are read.
constexpr milliseconds kWatchInterval{500};
/// So long may the end of an instance take.
constexpr std::int64_t kConnectTimeoutNs = 1'000'000'000;

std::string last_error() {
  std::size_t length = 0;
  const char* const text = lw_last_error(&length);
  return {text, length};
}

}  // namespace

LightSource::LightSource(const Configuration& configuration, Messages& messages)
    : configuration_(configuration), messages_(messages) {
  if (configuration_.T_space_probe) T_space_probe_ = *configuration_.T_space_probe;
}

LightSource::~LightSource() {
  {
    const std::lock_guard lock(mutex_);
    phase_ = Phase::stopping;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void LightSource::add_user() {
  {
    const std::lock_guard lock(mutex_);
    ++users_;
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  }
  wake_.notify_all();
}

void LightSource::remove_user() {
  {
    const std::lock_guard lock(mutex_);
    --users_;
  }
  wake_.notify_all();
}

LightSource::Connection LightSource::connection() const {
  const std::lock_guard lock(mutex_);
  return {probe_, T_space_probe_};
}

std::shared_ptr<lw_probe> LightSource::connect() {
  lw_probe_options options{};
  options.size = sizeof options;
  options.max_age_ns = kMaxAgeNs;
  // No light is predicted: lastUpdatedTime would change with every query.
  options.extrapolation_ns = -1;
  options.connect_timeout_ns = kConnectTimeoutNs;
  if (!configuration_.credentials.empty()) options.credentials_folder = configuration_.credentials.c_str();
  lw_probe* probe = nullptr;
  if (lw_probe_connect(configuration_.uri.data(), configuration_.uri.size(), &options, &probe) == LW_OK)
    return {probe, lw_probe_close};
  messages_.error("xrCreateLightEstimatorANDROID", "no light from the probe: " + last_error());
  return nullptr;
}

void LightSource::watch(lw_probe* probe) {
  lw_link_stats stats{};
  stats.size = sizeof stats;
  if (lw_probe_get_stats(probe, &stats) == LW_OK && stats.state == LW_LINK_WAITING) {
    std::array<char, 512> text{};
    if (lw_probe_text(probe, LW_PROBE_LAST_ERROR, text.data(), text.size(), nullptr) == LW_OK)
      messages_.error("xrGetLightEstimateANDROID", std::string("the probe was lost: ") + text.data());
  }
  if (configuration_.T_space_probe) return;
  lw_probe_info info{};
  info.size = sizeof info;
  if (lw_probe_get_info(probe, &info) != LW_OK || info.mounted == 0) return;
  const auto& [x, y, z, w] = info.orientation;
  const std::lock_guard lock(mutex_);
  T_space_probe_ = {Quat{x, y, z, w}.normalized(), {info.position[0], info.position[1], info.position[2]}};
}

void LightSource::run() {
  const auto idle = [this] { return phase_ == Phase::stopping || users_ == 0; };
  milliseconds pause = kFirstPause;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return phase_ == Phase::stopping || users_ > 0; });
    if (phase_ == Phase::stopping) return;
    lock.unlock();
    std::shared_ptr<lw_probe> probe = connect();
    // Before its first use the pose of the probe is known.
    if (probe) watch(probe.get());
    lock.lock();
    if (!probe) {
      wake_.wait_for(lock, pause, idle);
      pause = std::min(2 * pause, kMaxPause);
      continue;
    }
    pause = kFirstPause;
    probe_ = probe;
    while (!wake_.wait_for(lock, kWatchInterval, idle)) {
      lock.unlock();
      watch(probe.get());
      lock.lock();
    }
    probe_.reset();
    lock.unlock();
    probe.reset();
    lock.lock();
  }
}

}  // namespace lightwell::xr
