// The list of paired clients: a text file that the owner of the probe can read and delete lines from.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

/// Length of a token in characters: 32 random bytes in base64url.
inline constexpr std::size_t kTokenLength = 43;

/// One line of the file: digest of the token, digest of the certificate ("-": none), expiry, name.
struct ClientEntry {
  std::string token_digest;        ///< SHA-256, 64 hex digits. A token has 256 random bits, so a fast hash suffices.
  std::string certificate_digest;  ///< SHA-256 of the DER form, 64 hex digits, or empty.
  std::int64_t expires_s = 0;      ///< Seconds since 1970; from then on token and certificate are invalid.
  std::string name;                ///< For people; a single line.
};

/// The file `clients` of the key folder. Each query checks whether the file has changed and then reads it again, so
/// that lines added by a pairing process and lines deleted by the owner take effect at once. If the file has an error,
/// the last valid list stays in effect. Any thread.
class ClientList {
 public:
  explicit ClientList(std::string path) : path_(std::move(path)) {}

  /// data_loss: a line is invalid; the message names it. A missing file is an empty list.
  [[nodiscard]] Status load();

  /// Takes the same time for every token, including missing ("") and expired ones and those of another length: hashes
  /// it and compares it with every line in constant time.
  [[nodiscard]] bool accepts_token(std::string_view token, std::int64_t now_s);
  /// `digest`: SHA-256 of the DER form, 64 hex digits.
  [[nodiscard]] bool accepts_certificate(std::string_view digest, std::int64_t now_s);

  /// The present error in the file and its remedy, empty without one. Checks the file.
  [[nodiscard]] std::string error_message();
  /// Number of changes of the file that could not be read.
  [[nodiscard]] std::uint64_t faults() const;

  /// Adds a line and removes expired ones. The caller holds the folder's lock. resource_exhausted: 256 clients.
  [[nodiscard]] static Status add(const std::string& path, ClientEntry entry, std::int64_t now_s);

 private:
  /// Reads the file again if it has changed. If that fails, keeps the entries. The caller holds the mutex.
  void refresh();

  const std::string path_;
  mutable std::mutex mutex_;
  std::vector<ClientEntry> entries_;  ///< Of the last valid file.
  std::string error_message_;
  std::uint64_t faults_ = 0;
  /// Inode, size and modification time of the file when it was last read; empty: not read yet.
  std::string file_state_;
};

}  // namespace lightwell
