#include <utility>
#include <variant>

#include <lightwell/probe.hpp>

#include "core/intake.hpp"
#include "core/source.hpp"
#include "core/uri.hpp"

namespace lightwell {

std::string_view version() { return LIGHTWELL_VERSION; }

Status ProbeOptions::validate() const {
  const auto refused = [](std::string_view what) {
    return Status(StatusCode::invalid_argument, "ProbeOptions: " + std::string(what));
  };
  if (max_age.ns <= 0) return refused("max_age must be above zero");
  if (history < 1 || history > 4096) return refused("history must be 1 to 4096");
  if (connect_timeout.ns <= 0) return refused("connect_timeout must be above zero");
  if (retry_min.ns <= 0) return refused("retry_min must be above zero");
  if (retry_max < retry_min) return refused("retry_max must not be below retry_min");
  if (silence_limit < Duration::from_seconds(2))
    return refused("silence_limit must be 2 s or more, for the probe is asked once a second");
  return {};
}

struct Probe::Impl {
  explicit Impl(const ProbeOptions& options) : intake(options) {}
  core::Intake intake;
  std::unique_ptr<core::Source> source;  // behind the intake, so that its thread ends first
};

Probe::Probe(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Probe::Probe(Probe&&) noexcept = default;
Probe& Probe::operator=(Probe&&) noexcept = default;
Probe::~Probe() = default;

Result<Probe> Probe::connect(std::string_view uri, ProbeOptions options) {
  if (Status status = options.validate(); !status.ok()) return status;
  const Result<core::ProbeUri> where = core::parse_probe_uri(uri);
  if (!where.ok()) return where.status();

  auto impl = std::make_unique<Impl>(options);
  if (const auto* replay = std::get_if<core::ReplayPath>(&*where)) {
    Result<std::unique_ptr<core::Source>> source = core::make_replay_source(*replay, impl->intake);
    if (!source.ok()) return source.status();
    impl->source = std::move(*source);
    return Probe(std::move(impl));
  }
  impl->source = core::make_grpc_source(std::get<core::GrpcAddress>(*where), options, impl->intake);
  const Status described = impl->intake.wait_until_described(options.connect_timeout);
  if (!described.ok())
    return Status(described.code(), std::string(uri) + ": " + described.message() +
                                        "; is lightwelld running there, and is its grpc.listen an "
                                        "address that this machine reaches?");
  return Probe(std::move(impl));
}

Lighting Probe::latest() const { return impl_->intake.latest({monotonic_now_ns()}); }
Lighting Probe::at(HostTime time) const { return impl_->intake.at(time); }

Result<Lighting> Probe::wait_for_next(std::optional<std::uint64_t> seen, Duration timeout) const {
  if (Status status = impl_->intake.wait_for_next(seen, timeout); !status.ok()) return status;
  return latest();
}

ProbeInfo Probe::info() const { return impl_->intake.info(); }
LinkStats Probe::stats() const { return impl_->intake.stats(); }

Status Probe::set_estimator(const EstimatorConfig& config) {
  if (Status status = config.validate(); !status.ok()) return status;
  return impl_->source->set_estimator(config);
}

Result<double> Probe::report_lux(double lux, Vec3f normal) {
  if (!(lux > 0) || !(lux < 1e9))
    return Status(StatusCode::invalid_argument, "report_lux: lux must be above zero, below 1e9");
  const Vec3f unit = normalized(normal);
  if (unit == Vec3f{})
    return Status(StatusCode::invalid_argument, "report_lux: the normal is zero or not finite");
  return impl_->source->report_lux(lux, unit);
}

}  // namespace lightwell
