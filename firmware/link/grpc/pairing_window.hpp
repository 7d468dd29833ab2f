// Two minutes in which a person can make a client known to this probe, by a code. Its own server on its own port: no
// stranger ever speaks to the one that serves the light.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "link/access/probe_keys.hpp"

namespace lightwell {

struct PairingWindowOptions {
  std::string listen;  ///< HOST:PORT; port 0 takes any.
  std::string probe_name;
  int port = 0;  ///< Of ProbeService, told to the client; 0: not known.
  int days = 365;
  std::chrono::seconds open_for{120};
};

enum class PairingOutcome {
  open,
  paired,
  too_many_wrong_codes,    ///< Three wrong codes.
  timed_out,  ///< Nobody came, or nobody finished.
};

class PairingWindow {
 public:
  static constexpr int kMaxWrongCodes = 3;
  /// Exchanges that may be begun, finished or not.
  static constexpr int kMaxExchanges = 16;

  /// Listens at once. resource_exhausted where the port cannot be had.
  [[nodiscard]] static Result<std::unique_ptr<PairingWindow>> open(const PairingWindowOptions& options,
                                                                   const ProbeKeys& keys);
  PairingWindow(const PairingWindow&) = delete;
  PairingWindow& operator=(const PairingWindow&) = delete;
  ~PairingWindow();

  /// What the person types on the client: six digits, good for one pairing.
  [[nodiscard]] const std::string& code() const;
  /// "grpcs://0.0.0.0:7421".
  [[nodiscard]] std::string address() const;
  /// Of the client that came, for people.
  [[nodiscard]] std::string client_name() const;
  [[nodiscard]] int wrong_codes() const;

  /// Waits until the window closes, at most so long. Any thread.
  [[nodiscard]] PairingOutcome wait(std::chrono::milliseconds timeout);

 private:
  struct Impl;
  explicit PairingWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightwell
