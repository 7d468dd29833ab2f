// Client side of pairing: proto/lightwell/v1/pairing.proto.
#include <memory>
#include <utility>

#include <grpc/grpc_security_constants.h>
#include <grpcpp/client_context.h>
#include <grpcpp/security/auth_context.h>

#include <lightwell/credentials.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/pair.hpp>
#include <lightwell/pairing.hpp>
#include <lightwell/secrets.hpp>
#include <lightwell/v1/pairing.grpc.pb.h>

#include "core/credential_store.hpp"
#include "core/grpc_channel.hpp"
#include "core/uri.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kCodeDigits = 6;

/// The digits of a code, without the spaces and dashes that a user may have typed.
Result<std::string> digits_of(std::string_view code) {
  std::string out;
  for (const char c : code)
    if (c != ' ' && c != '-') out += c;
  if (out.size() != kCodeDigits || out.find_first_not_of("0123456789") != std::string::npos)
    return Status(StatusCode::invalid_argument, "the code must be the six digits that the probe shows");
  return out;
}

/// Digest of the certificate that the server presented in this call.
Result<std::string> shown_certificate(const grpc::ClientContext& context) {
  const std::shared_ptr<const grpc::AuthContext> with = context.auth_context();
  if (!with) return Status(StatusCode::data_loss, "the connection is not encrypted");
  const std::vector<grpc::string_ref> shown = with->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  if (shown.empty()) return Status(StatusCode::data_loss, "the probe presented no certificate");
  return certificate_digest({shown.front().data(), shown.front().size()});
}

/// Replaces the port of "host:port".
std::string with_port(const std::string& host_port, std::uint32_t port) {
  return host_port.substr(0, host_port.rfind(':') + 1) + std::to_string(port);
}

/// Both round trips of the pairing; returns the probe's response after mutual authentication.
Result<v1::PairCredentials> request_credentials(const core::GrpcAddress& address, const PairOptions& options,
                                                PairingExchange exchange, const KeyPair& key) {
  v1::PairingService::Stub stub(core::new_channel(address.host_port, core::unverified_credentials()));
  v1::PairBeginRequest begin;
  begin.set_share(exchange.share());
  v1::PairBeginResponse begun;
  grpc::ClientContext first;
  first.set_deadline(core::deadline_after(options.timeout));
  if (Status s = core::status_of(stub.Begin(&first, begin, &begun)); !s.ok()) return s;
  const Result<std::string> certificate = shown_certificate(first);
  if (!certificate.ok()) return certificate.status();
  if (Status s = exchange.process_peer_share(begun.share(), *certificate); !s.ok()) return s;

  v1::PairApplication application;
  application.set_client_name(options.client_name.empty() ? host_name() : options.client_name);
  application.set_public_key(key.public_pem);
  v1::PairFinishRequest finish;
  finish.set_session(begun.session());
  finish.set_confirmation(exchange.confirmation());
  Result<SealedMessage> sealed = std::move(exchange).seal(application.SerializeAsString());
  if (!sealed.ok()) return sealed.status();
  finish.set_sealed(std::move(sealed->bytes));
  v1::PairFinishResponse finished;
  grpc::ClientContext second;
  second.set_deadline(core::deadline_after(options.timeout));
  if (Status s = core::status_of(stub.Finish(&second, finish, &finished)); !s.ok()) return s;
  const Result<std::string> opened = sealed->reader.open(finished.sealed());
  v1::PairCredentials credentials;
  if (!sealed->reader.confirms(finished.confirmation()) || !opened.ok() || !credentials.ParseFromString(*opened))
    return Status(StatusCode::data_loss, "the response is not from the probe that shows this code");
  return credentials;
}

}  // namespace

Result<PairedProbe> pair_with_probe(std::string_view uri, std::string_view code, const PairOptions& options) {
  const Result<core::GrpcAddress> address = core::parse_pairing_uri(uri);
  if (!address.ok()) return address.status();
  const Result<std::string> digits = digits_of(code);
  if (!digits.ok()) return digits.status();
  const std::string store = options.store.empty() ? default_credential_store() : options.store;
  if (store.empty())
    return Status(StatusCode::failed_precondition, "there is no folder for credentials: set HOME or XDG_CONFIG_HOME");
  Result<PairingExchange> exchange = PairingExchange::begin(PairingSide::client, *digits);
  if (!exchange.ok()) return exchange.status();
  Result<KeyPair> key = KeyPair::make();
  if (!key.ok()) return key.status();

  const Result<v1::PairCredentials> pairing_response =
      request_credentials(*address, options, std::move(*exchange), *key);
  if (!pairing_response.ok()) return pairing_response.status().in(std::string(uri));

  core::PairedFiles files;
  files.name = pairing_response->probe_name().substr(0, pairing_response->probe_name().find_first_of("\r\n"));
  files.credentials.pinned = pairing_response->probe_ca();
  files.credentials.client_certificate = pairing_response->client_certificate();
  if (!pairing_response->client_certificate().empty()) files.credentials.client_key = key->private_pem;
  files.credentials.token = pairing_response->token();
  if (pairing_response->port() != 0) files.address = with_port(address->host_port, pairing_response->port());
  if (const Status s = files.credentials.validate(); !s.ok())
    return Status(StatusCode::data_loss, std::string(uri) + ": " + s.message());
  const Result<std::string> folder = core::keep_credentials(store, files);
  if (!folder.ok()) return folder.status();
  return PairedProbe{files.name, *folder, files.address.empty() ? std::string() : "grpcs://" + files.address,
                     pairing_response->expires_s()};
}

}  // namespace lightwell
