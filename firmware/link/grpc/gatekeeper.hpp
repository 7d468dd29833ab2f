// Lets a call in, or not: before its message is read and before any handler runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include <grpcpp/security/auth_metadata_processor.h>

#include "link/access/client_list.hpp"

namespace lightwell {

/// Whom a certificate that the handshake accepted lets in.
enum class CertificateRule {
  any,     ///< All: the owner's authority has judged.
  listed,  ///< Those of the client list.
};

/// A call needs a certificate that the handshake accepted, or a token of the client list; health needs neither. No
/// token, a wrong one and an expired one get the same code and text after the same work.
class Gatekeeper final : public grpc::AuthMetadataProcessor {
 public:
  Gatekeeper(std::shared_ptr<ClientList> clients, CertificateRule rule) : clients_(std::move(clients)), rule_(rule) {}

  /// What it does takes microseconds: gRPC need not start a thread for it.
  [[nodiscard]] bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata* consumed,
                       OutputMetadata* response) override;

  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool admits_certificate(const grpc::AuthContext& context, std::int64_t now_s) const;

  const std::shared_ptr<ClientList> clients_;
  const CertificateRule rule_;
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace lightwell
