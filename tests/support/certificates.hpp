// Certificates for tests, made with openssl.
#pragma once

#include <string>

#include "support/temp_dir.hpp"

namespace lightwell::test {

/// Paths of PEM files without passphrases.
struct KeyPair {
  std::string certificate, key;
};

/// A certificate authority; its files are deleted with the object.
class Authority {
 public:
  explicit Authority(const std::string& name);

  [[nodiscard]] const std::string& certificate() const { return ca_.certificate; }

  /// Issues a certificate, by default for 127.0.0.1 and localhost. Negative `days`: expired.
  [[nodiscard]] KeyPair sign(const std::string& name,
                             const std::string& subject_alt_name = "IP:127.0.0.1,DNS:localhost", int days = 1) const;

 private:
  TempDir folder_;
  KeyPair ca_;
};

}  // namespace lightwell::test
