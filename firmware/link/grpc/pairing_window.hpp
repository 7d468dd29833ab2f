// A time window, by default of two minutes, in which one client can be paired by a six-digit code (SPAKE2, RFC 9382).
// It is a separate server on its own port, so that unauthenticated clients never reach the server of the descriptors.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "link/access/probe_keys.hpp"

namespace lightwell {

struct PairingWindowOptions {
  std::string listen;  ///< HOST:PORT; port 0 means any free port.
  std::string probe_name;
  int port = 0;                       ///< Of ProbeService, sent to the client; 0: unknown.
  int client_certificate_days = 365;  ///< Validity of the client's credentials.
  std::chrono::seconds open_for{120};
};

enum class PairingOutcome {
  open,
  paired,
  too_many_wrong_codes,  ///< kMaxWrongCodes wrong codes.
  timed_out,             ///< No client completed the pairing.
};

class PairingWindow {
 public:
  static constexpr int kMaxWrongCodes = 3;
  /// Maximum number of exchanges begun in one window, finished or not.
  static constexpr int kMaxExchanges = 16;

  /// Starts to listen. resource_exhausted: the port cannot be used.
  [[nodiscard]] static Result<std::unique_ptr<PairingWindow>> open(const PairingWindowOptions& options,
                                                                   const ProbeKeys& keys);
  virtual ~PairingWindow() = default;

  /// The code to be entered on the client: six digits, valid for one pairing.
  [[nodiscard]] virtual const std::string& code() const = 0;
  /// The address for clients, for example "grpcs://0.0.0.0:7421".
  [[nodiscard]] virtual std::string address() const = 0;
  /// Name of the paired client, for people; empty before.
  [[nodiscard]] virtual std::string client_name() const = 0;
  [[nodiscard]] virtual int wrong_codes() const = 0;

  /// Waits until the window closes, at most for `timeout`. Any thread.
  [[nodiscard]] virtual PairingOutcome wait(std::chrono::milliseconds timeout) = 0;
};

}  // namespace lightwell
