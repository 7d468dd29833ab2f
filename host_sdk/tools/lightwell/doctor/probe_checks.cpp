#include "doctor/probe_checks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <lightwell/codec.hpp>
#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

std::string count_text(std::uint64_t n, const char* what) {
  return formatted("%llu %s", static_cast<unsigned long long>(n), what);
}

/// Problems, each with its remedy, as one finding.
class ProblemList {
 public:
  void add(std::string found, std::string remedy) {
    found_.push_back(std::move(found));
    remedies_.push_back(std::move(remedy));
  }
  [[nodiscard]] Finding finding(std::string if_none) const {
    return found_.empty() ? ok(std::move(if_none)) : warning(joined(found_), joined(remedies_));
  }

 private:
  std::vector<std::string> found_, remedies_;
};

}  // namespace

ConnectionFindings check_connection(const std::optional<NetworkAddress>& address, const Status& connected) {
  const bool encrypted = address && address->encryption == Encryption::tls;
  const Finding unencrypted =
      address ? not_checked("this address does not use TLS: everyone on the network can read and change the light",
                            "on a network that others use, run the probe with --security tls, and pair")
              : not_checked("not over a network");
  const Finding trusted = ok("encrypted, and the certificate is the one that this machine trusts");
  if (connected.ok())
    return {encrypted ? trusted : unencrypted, ok(encrypted ? "this client is accepted"
                                                  : address ? "every client is accepted"
                                                            : "opened")};
  const std::string why = connected.message();
  if (encrypted && contains(why, "TLS handshake failed"))
    return {fault(why,
                  "if the probe has new keys, pair again: `lightwelld --pair` there, `lightwell pair` here. If its "
                  "certificate has expired, compare the dates of both machines"),
            not_checked("the TLS handshake failed")};
  if (encrypted && (contains(why, "valid token or certificate") || contains(why, "this client's token")))
    return {trusted, fault(why,
                           "the probe does not know this client any more, or its token has expired: pair again "
                           "(`lightwelld --pair` there, `lightwell pair` here)")};
  const char* const remedy =
      !address                        ? ""
      : address->peer == Peer::broker ? "is the probe connected to this broker, with this topic (--mqtt)?"
      : encrypted                     ? "does the probe use TLS at this port (--security tls), and is this its port?"
                  : "if the probe uses TLS (--security tls), use grpcs:// or wss:// and pair; is this "
                    "the port of that link (gRPC 7420, web 7443)?";
  return {encrypted ? not_checked("no connection was made") : unencrypted, fault(why, remedy)};
}

Finding check_versions(const ProbeInfo& info) {
  const std::string found = "probe " + info.version + ", SDK " + std::string(version()) +
                            formatted(", messages of version %u", static_cast<unsigned>(kWireVersion));
  if (info.version == version()) return ok(found);
  return warning(found, "they are compatible; what was added since the older version is missing: update that side");
}

Finding check_clock(const ProbeInfo& info) {
  // An application cannot tell the age of light better than this; a frame takes 17 ms at 60 Hz.
  constexpr Duration kMaxUncertainty{10'000'000};
  constexpr double kMaxDrift_ppm = 99;
  const std::string found = formatted("the probe's clock is %+.3f s from this machine's, +-%.2f ms",
                                      info.clock_offset.seconds(), info.clock_uncertainty.milliseconds());
  if (info.clock_uncertainty > kMaxUncertainty)
    return warning(found,
                   "ages and times of light are known no better than this: messages take too long there and "
                   "back. Prefer a cable or a Wi-Fi with a better signal; a busy machine delays them, too");
  if (std::abs(info.clock_drift_ppm) > kMaxDrift_ppm)
    return warning(found + formatted(", and drifts by %.0f ppm", info.clock_drift_ppm),
                   "one of both clocks is set while it runs, or is a bad one; is a virtual machine paused at times?");
  // Each machine counts its clock from its own start, so that an offset is no fault.
  return ok(found + " (both count from their own start)");
}

void ArrivalRecorder::add(const Arrival& arrival) {
  const std::lock_guard lock(mutex_);
  if (ages_ms_.size() >= kMaxAges) return;
  if (ages_ms_.empty()) first_ = arrival.received;
  last_ = arrival.received;
  ages_ms_.push_back((arrival.stored - arrival.mid_exposure).milliseconds());
}

ArrivalStatistics ArrivalRecorder::statistics() const {
  const std::lock_guard lock(mutex_);
  ArrivalStatistics out;
  if (ages_ms_.empty()) return out;
  std::vector<double> ages_ms = ages_ms_;
  out.count = ages_ms.size();
  if (last_ > first_) out.per_second = static_cast<double>(out.count - 1) / (last_ - first_).seconds();
  out.age_median_ms = lower_quantile(ages_ms, 0.5);
  out.age_max_ms = lower_quantile(ages_ms, 1);
  return out;
}

Finding check_frames(const ArrivalStatistics& arrivals, const ProbeInfo& info, Duration waiting) {
  if (arrivals.count == 0) {
    const std::string found = formatted(
        "no descriptor within %.0f s; since its start the probe counts %llu frames of "
        "its camera and %llu estimates",
        waiting.seconds(), static_cast<unsigned long long>(info.counters.frames),
        static_cast<unsigned long long>(info.counters.estimates));
    return fault(found, info.counters.frames == 0
                            ? "the camera delivers nothing: is it plugged in, and not used by another program? See the "
                              "probe's log (`journalctl -u lightwelld`)"
                            : "see the probe's log (`journalctl -u lightwelld`)");
  }
  const std::string found = formatted("%zu descriptors, %.1f a second, age %.0f ms in the median, %.0f ms at most",
                                      arrivals.count, arrivals.per_second, arrivals.age_median_ms, arrivals.age_max_ms);
  if (arrivals.age_median_ms > Lighting::kDefaultMaxAge.milliseconds())
    return warning(found, formatted("light older than %.0f ms is stale by default: is the network slow, or the probe's "
                                    "processor? `lightwell watch` shows latency and age apart; a faster setting: "
                                    "`lightwell config set URI setting=fast`; or set a larger max_age",
                                    Lighting::kDefaultMaxAge.milliseconds()));
  return ok(found);
}

Finding check_losses(const LinkStats& stats) {
  ProblemList problems;
  if (stats.undecodable + stats.oversized + stats.frames_refused > 0)
    problems.add(count_text(stats.undecodable + stats.oversized + stats.frames_refused, "messages refused") + " (" +
                     stats.last_error + ")",
                 "the probe is of another version, or something on the way damages messages");
  if (stats.gaps + stats.frames_lost > 0)
    problems.add(count_text(stats.gaps + stats.frames_lost, "of") + " " +
                     count_text(stats.received + stats.gaps + stats.frames_lost, "descriptors missing"),
                 "the link or this machine is too slow for the probe's rate: a cable or a better Wi-Fi, fewer clients, "
                 "or a lower frame rate");
  if (stats.untimely + stats.replayed > 0)
    problems.add(count_text(stats.untimely + stats.replayed, "descriptors repeated or dated in the future"),
                 "does another client of the broker publish in the probe's name?");
  if (stats.reconnects > 0)
    problems.add(count_text(stats.reconnects, "connections lost"),
                 "the network is interrupted, or the probe restarts: see its log");
  return problems.finding("none of " + count_text(stats.received, "descriptors"));
}

Finding check_probe_status(const ProbeInfo& info) {
  constexpr float kMaxTemperature_c = 80;
  const Counters& c = info.counters;
  ProblemList problems;
  for (const LinkStatus& link : info.links)
    if (link.fault) problems.add("its link " + link.name + " has a fault", "the probe's log names it");
  if (c.estimates_failed > 0)
    problems.add(count_text(c.estimates_failed, "estimates failed"), "the probe's log has the reasons");
  if (c.estimates_late_at_fast > 0)
    problems.add(count_text(c.estimates_late_at_fast, "estimates over its time limit even at its cheapest setting"),
                 "raise budget_ms, or lower the camera's resolution or rate");
  if (c.captures_dropped > c.frames / 10)
    problems.add(
        formatted("%llu of %llu frames dropped", static_cast<unsigned long long>(c.captures_dropped),
                  static_cast<unsigned long long>(c.frames)),
        "estimation is slower than the camera: `lightwell config set URI setting=fast`, or a lower frame rate");
  if (c.client_list_faults > 0)
    problems.add("its list of clients has invalid lines", "correct the file `clients` in the probe's key folder");
  if (c.recording_faults > 0)
    problems.add(count_text(c.recording_faults, "recordings ended by a fault"), "is the probe's disk full?");
  if (c.authentication_failures > 0)
    problems.add(count_text(c.authentication_failures, "calls without valid credentials"),
                 "a client that should be paired is not, or someone tries");
  if (info.temperature_c && *info.temperature_c > kMaxTemperature_c)
    problems.add(formatted("%.0f degrees Celsius", static_cast<double>(*info.temperature_c)),
                 "boards slow down when hot: cool it");
  return problems.finding("'" + info.name + "', camera " + info.camera + ", " +
                          count_text(c.estimates, "estimates since its start, no fault"));
}

Finding check_light(const Lighting& lighting) {
  if (lighting.validity() != Validity::valid && lighting.validity() != Validity::stale)
    return not_checked(lighting.reason());
  const Descriptor& d = lighting.descriptor();
  ProblemList problems;
  if (d.flags.has(Flag::dark)) problems.add("only darkness", "is the lens covered, or its cap on?");
  if (d.flags.has(Flag::clipped))
    problems.add("pixels are saturated in every exposure: the brightest light is stronger than reported",
                 "shorter exposures (--exposure-s 0.0005,0.004,0.03)");
  if (!std::isfinite(d.bound.total))
    problems.add("no bound of the error is known (" + flags_text(d.flags) + ")",
                 "the flags say why: parts of the sphere that no pixel sees, saturation");
  return problems.finding(formatted("%zu lights, error at most %s, %s units", d.lights.size(),
                                    bound_text(d.bound.total).c_str(),
                                    d.units == Units::absolute ? "absolute" : "relative"));
}

}  // namespace lightwell::tool
