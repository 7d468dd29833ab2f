// Who may ask the probe: the clients that were paired, as a file that its owner can read and cut lines from.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell {

/// Characters of a token: 32 random bytes in base64url.
inline constexpr std::size_t kTokenLength = 43;

/// One line of the file: digest of the token, digest of the certificate ("-": none), end, name.
struct ClientEntry {
  std::string token_digest;        ///< SHA-256, 64 hex digits. A token has 256 random bits: it needs no slow hash.
  std::string certificate_digest;  ///< SHA-256 of its DER form, 64 hex digits, or empty.
  std::int64_t expires_s = 0;      ///< Seconds since 1970; from then on neither is good.
  std::string name;                ///< For people; on one line.
};

/// The file `clients` of the key folder. Looked at before every answer and read again where it changed, so that a line
/// added by a pairing process counts at once, and one that was cut off no longer. A mistake in it leaves all as it was
/// before. Any thread.
class ClientList {
 public:
  explicit ClientList(std::string path) : path_(std::move(path)) {}

  /// data_loss names the line that is wrong. No file is no clients.
  [[nodiscard]] Status load();

  /// The same work for every token, missing ("") and expired ones included, whatever their length: each is hashed and
  /// compared with every line, in constant time.
  [[nodiscard]] bool accepts_token(std::string_view token, std::int64_t now_s);
  /// `digest` as in the file.
  [[nodiscard]] bool accepts_certificate(std::string_view digest, std::int64_t now_s);

  /// What is wrong with the file as it is now, and what to do; empty: nothing. Looks at the file.
  [[nodiscard]] std::string error_message();
  /// How often the file changed into one that cannot be read.
  [[nodiscard]] std::uint64_t faults() const;

  /// Adds a line and leaves out those that expired. The caller holds the folder's lock. resource_exhausted at 256
  /// clients.
  [[nodiscard]] static Status add(const std::string& path, ClientEntry entry, std::int64_t now_s);

 private:
  /// A file that cannot be read or has a wrong line leaves the clients as they are. The mutex is held.
  void refresh();

  const std::string path_;
  mutable std::mutex mutex_;
  std::vector<ClientEntry> entries_;  ///< Of the last file without a mistake.
  std::string error_message_;
  std::uint64_t faults_ = 0;
  /// Which file, how long, and when it was changed; empty: not looked at yet.
  std::string file_state_;
};

}  // namespace lightwell
