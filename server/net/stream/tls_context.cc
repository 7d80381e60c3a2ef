#include "server/net/stream/tls_context.h"

#include <array>
#include <system_error>
#include <utility>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

Status CheckFile(const char* what, const std::filesystem::path& file) {
  std::error_code ignored;  // what cannot be looked at cannot be read either
  return std::filesystem::is_regular_file(file, ignored)
             ? Status()
             : Status(StatusCode::kNotFound, StrCat("TLS: there is no ", what, " ", file.string()));
}

Status Refuse(const char* what, const std::filesystem::path& file) {
  return {StatusCode::kInvalidData,
          StrCat("TLS: ", what, " ", file.string(), " is not usable: ", TakeTlsErrors())};
}

std::string NameEntry(const X509_NAME* name, int nid) {
  const int at = X509_NAME_get_index_by_NID(name, nid, -1);
  if (at < 0) {
    return {};
  }
  const ASN1_STRING* const data = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at));
  unsigned char* text = nullptr;
  const int size = ASN1_STRING_to_UTF8(&text, data);
  std::string entry;
  if (size > 0) {
    entry.assign(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
  }
  OPENSSL_free(text);
  return entry;
}

// Where there are lists of what was revoked, no certificate counts without one, nor one whose
// authority is in between and was revoked itself, or has no list.
void UseRevocations(X509_STORE& store) {
  STACK_OF(X509_OBJECT)* const objects = X509_STORE_get0_objects(&store);
  for (int i = 0; i < sk_X509_OBJECT_num(objects); ++i) {
    if (X509_OBJECT_get_type(sk_X509_OBJECT_value(objects, i)) == X509_LU_CRL) {
      X509_STORE_set_flags(&store, X509_V_FLAG_CRL_CHECK | X509_V_FLAG_CRL_CHECK_ALL);
    }
  }
}

Status UseClientAuthorities(SSL_CTX& context, const std::filesystem::path& file) {
  ATLAS_RETURN_IF_ERROR(CheckFile("list of authorities", file));
  STACK_OF(X509_NAME)* const names = SSL_load_client_CA_file(file.c_str());
  if (names == nullptr || SSL_CTX_load_verify_file(&context, file.c_str()) != 1) {
    sk_X509_NAME_pop_free(names, X509_NAME_free);
    return Refuse("list of authorities", file);
  }
  SSL_CTX_set_client_CA_list(&context, names);
  UseRevocations(*SSL_CTX_get_cert_store(&context));
  SSL_CTX_set_verify(&context, SSL_VERIFY_PEER, nullptr);  // one without may show a token instead
  return {};
}

Status Configure(SSL_CTX& context, const TlsFiles& files) {
  ATLAS_RETURN_IF_ERROR(CheckFile("certificate", files.certificate));
  ATLAS_RETURN_IF_ERROR(CheckFile("key", files.key));
  SSL_CTX_set_min_proto_version(&context, TLS1_3_VERSION);
  // Idle connections hold no buffers; what is left of a write may be tried again from elsewhere.
  SSL_CTX_set_mode(&context, SSL_MODE_RELEASE_BUFFERS | SSL_MODE_ENABLE_PARTIAL_WRITE |
                                 SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  SSL_CTX_set_read_ahead(&context, 1);  // a call for many records
  // A call ends with what came so far; else a peer that sends nothing but messages of TLS itself
  // would hold its thread for as long as it likes.
  SSL_CTX_clear_mode(&context, SSL_MODE_AUTO_RETRY);
  // Frames tell themselves whether they are whole: a peer that just goes is no failure.
  SSL_CTX_set_options(&context, SSL_OP_IGNORE_UNEXPECTED_EOF);
  // Vehicles stay connected: tickets for the next handshake would only cost bytes.
  SSL_CTX_set_num_tickets(&context, 0);
  SSL_CTX_set_session_cache_mode(&context, SSL_SESS_CACHE_OFF);
  if (SSL_CTX_use_certificate_chain_file(&context, files.certificate.c_str()) != 1) {
    return Refuse("certificate", files.certificate);
  }
  if (SSL_CTX_use_PrivateKey_file(&context, files.key.c_str(), SSL_FILETYPE_PEM) != 1 ||
      SSL_CTX_check_private_key(&context) != 1) {
    return Refuse("key", files.key);
  }
  return files.client_ca.empty() ? Status() : UseClientAuthorities(context, files.client_ca);
}

}  // namespace

void SslDeleter::operator()(ssl_st* session) const {
  SSL_free(session);
}

void TlsContext::ContextDeleter::operator()(ssl_ctx_st* context) const {
  SSL_CTX_free(context);
}

Result<std::shared_ptr<const TlsContext>> TlsContext::Load(const TlsFiles& files) {
  ERR_clear_error();
  std::unique_ptr<ssl_ctx_st, ContextDeleter> context(SSL_CTX_new(TLS_server_method()));
  if (context == nullptr) {
    return Error(StatusCode::kInternal, StrCat("TLS: ", TakeTlsErrors()));
  }
  if (Status status = Configure(*context, files); !status.ok()) {
    return Error(std::move(status));
  }
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(context)));
}

SslSession TlsContext::NewSession(int descriptor) const {
  SslSession session(SSL_new(context_.get()));
  if (session == nullptr || SSL_set_fd(session.get(), descriptor) != 1) {
    return nullptr;
  }
  SSL_set_accept_state(session.get());
  return session;
}

Status TlsContext::CheckPeer(const ssl_st& session) const {
  X509* const certificate = SSL_get0_peer_certificate(&session);
  if (certificate == nullptr) {
    return {};
  }
  const std::unique_ptr<X509_STORE_CTX, decltype(&X509_STORE_CTX_free)> check(X509_STORE_CTX_new(),
                                                                              &X509_STORE_CTX_free);
  if (check == nullptr ||
      X509_STORE_CTX_init(check.get(), SSL_CTX_get_cert_store(context_.get()), certificate,
                          SSL_get_peer_cert_chain(&session)) != 1) {
    return {StatusCode::kInternal, StrCat("TLS: ", TakeTlsErrors())};
  }
  X509_STORE_CTX_set_purpose(check.get(), X509_PURPOSE_SSL_CLIENT);
  if (X509_verify_cert(check.get()) == 1) {
    return {};
  }
  const int error = X509_STORE_CTX_get_error(check.get());
  return {StatusCode::kPermissionDenied,
          StrCat("its certificate does not count: ", X509_verify_cert_error_string(error))};
}

std::optional<PeerCertificate> CertificateOf(const ssl_st& session) {
  const X509* const certificate = SSL_get0_peer_certificate(&session);
  if (certificate == nullptr || SSL_get_verify_result(&session) != X509_V_OK) {
    return std::nullopt;
  }
  const X509_NAME* const name = X509_get_subject_name(certificate);
  return PeerCertificate{NameEntry(name, NID_commonName),
                         NameEntry(name, NID_organizationalUnitName)};
}

std::string TakeTlsErrors() {
  std::string text;
  while (const unsigned long error = ERR_get_error()) {
    std::array<char, 256> line{};
    ERR_error_string_n(error, line.data(), line.size());
    text += (text.empty() ? "" : "; ") + std::string(line.data());
  }
  return text.empty() ? "no reason given" : text;
}

}  // namespace atlas
