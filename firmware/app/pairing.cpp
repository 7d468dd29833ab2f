#include <charconv>
#include <chrono>
#include <ctime>
#include <iostream>
#include <memory>

#include <lightwell/pairing.hpp>

#include "app/daemon.hpp"
#include "app/log.hpp"
#include "link/access/probe_keys.hpp"
#include "link/grpc/pairing_window.hpp"

namespace lightwell {
namespace {

/// The number after the last colon; 0 if there is none.
int port_of(const std::string& listen) {
  int port = 0;
  const char* const end = listen.data() + listen.size();
  std::from_chars(listen.data() + listen.rfind(':') + 1, end, port);
  return port;
}

Status status_of(PairingOutcome outcome, const PairingWindow& window) {
  switch (outcome) {
    case PairingOutcome::paired:
      return {};
    case PairingOutcome::too_many_wrong_codes:
      return {StatusCode::unavailable,
              "three wrong codes were received and the window is closed: if you entered none of them, somebody on the "
              "network is guessing"};
    case PairingOutcome::open:
    case PairingOutcome::timed_out:
      break;
  }
  return {StatusCode::unavailable, "no client was paired (" + std::to_string(window.wrong_codes()) +
                                       " wrong codes); start again for a new code"};
}

}  // namespace

Status run_pairing(const Config& config, const std::string& listen) {
  if (!config.grpc.encrypted())
    return {StatusCode::failed_precondition,
            "pairing needs encryption: set grpc.security to LINK_SECURITY_TLS or LINK_SECURITY_MUTUAL_TLS, or use "
            "--security tls"};
  const Result<ProbeKeys> keys = load_probe_keys(config.grpc, config.probe_name, std::time(nullptr));
  if (!keys) return keys.status();
  PairingWindowOptions options;
  options.listen = listen.empty() ? config.grpc.listen_address.substr(0, config.grpc.listen_address.rfind(':')) + ":" +
                                        std::to_string(kDefaultPairingPort)
                                  : listen;
  options.probe_name = config.probe_name;
  options.port = port_of(config.grpc.listen_address);
  options.client_certificate_days = config.grpc.client_certificate_days;
  const Result<std::unique_ptr<PairingWindow>> opened = PairingWindow::open(options, *keys);
  if (!opened) return opened.status();
  PairingWindow& window = **opened;
  std::cout << "lightwelld: pairing on " << window.address() << " for " << options.open_for.count() << " s, code "
            << window.code() << std::endl;
  PairingOutcome outcome = PairingOutcome::open;
  while (outcome == PairingOutcome::open && !stop_signal_pending())
    outcome = window.wait(std::chrono::milliseconds(100));
  if (outcome == PairingOutcome::paired) log_info("paired with " + window.client_name());
  return status_of(outcome, window);
}

}  // namespace lightwell
