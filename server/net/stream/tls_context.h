// What the daemon shows its peers, and whose certificates it believes: TLS 1.3 (RFC 8446) and
// nothing older. Immutable and thread-safe: reloading makes another one.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/base/status.h"

struct ssl_ctx_st;
struct ssl_st;

namespace atlas {

struct TlsFiles {
  std::filesystem::path certificate;  // PEM, the chain of the daemon
  std::filesystem::path key;          // PEM, of the certificate
  // PEM, who vouches for peers; empty: none is asked for one. With revocation lists in it, one of
  // each of these authorities, they count.
  std::filesystem::path client_ca;
};

struct SslDeleter {
  void operator()(ssl_st* session) const;
};
using SslSession = std::unique_ptr<ssl_st, SslDeleter>;

// Whom a peer's certificate, which was verified, names.
struct PeerCertificate {
  std::string common_name;
  std::string organizational_unit;  // empty: none
};

class TlsContext {
 public:
  // kNotFound and kInvalidData name the file and what is wrong with it.
  static Result<std::shared_ptr<const TlsContext>> Load(const TlsFiles& files);

  // The daemon's end of a connection, before its handshake; null when there is no memory. The
  // descriptor, which does not block, is not owned.
  SslSession NewSession(int descriptor) const;

  // Whether the peer's certificate, which another context believed, is believed by this one. Ok
  // where there is none, kPermissionDenied.
  Status CheckPeer(const ssl_st& session) const;

 private:
  struct ContextDeleter {
    void operator()(ssl_ctx_st* context) const;
  };

  explicit TlsContext(std::unique_ptr<ssl_ctx_st, ContextDeleter> context)
      : context_(std::move(context)) {}

  std::unique_ptr<ssl_ctx_st, ContextDeleter> context_;
};

// After the handshake. nullopt: the peer showed none.
std::optional<PeerCertificate> CertificateOf(const ssl_st& session);
// What OpenSSL has to say about what this thread did last; takes it away.
std::string TakeTlsErrors();

}  // namespace atlas
