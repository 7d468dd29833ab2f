// Certificates that a test makes for its broker, with openssl.
#pragma once

#include <string>

#include "support/temp_dir.hpp"

namespace lightwell::test {

/// Paths of PEM files, without pass phrases.
struct KeyPair {
  std::string certificate, key;
};

/// An authority of a test's own, as long as the test lives.
class Authority {
 public:
  explicit Authority(const std::string& name);

  [[nodiscard]] const std::string& certificate() const { return ca_.certificate; }

  /// For 127.0.0.1 and localhost, or for another name alone. `days` below zero: expired.
  [[nodiscard]] KeyPair sign(const std::string& name,
                             const std::string& subject_alt_name = "IP:127.0.0.1,DNS:localhost", int days = 1) const;

 private:
  TempDir folder_;
  KeyPair ca_;
};

}  // namespace lightwell::test
