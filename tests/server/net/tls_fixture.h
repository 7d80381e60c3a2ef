// A daemon behind TLS, with certificates of its own for everybody.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "tests/server/net/net_fixture.h"
#include "tests/server/net/test_certificates.h"

namespace atlas {

inline constexpr const char* kTokenLine =  // "open sesame"
    " never 41ef4bb0b23661e66301aac36066912dac037827b4ae63a7b1165a5aa93ed4eb\n";

inline std::shared_ptr<const AccessControl> AccessOf(const std::string& tokens,
                                                     Role anonymous = Role::kNone) {
  return std::make_shared<const AccessControl>(TokenList::Parse(tokens, "tokens").value(),
                                               anonymous);
}

class TlsTest : public NetTest {
 protected:
  // Certificates of vehicles count, and the token of a `role`.
  void ServeTls(const std::string& role = "admin", std::string daemon_name = "daemon") {
    ca_ = std::make_unique<TestAuthority>(directory_, "fleet");
    security_ = SecurityOf(daemon_name, AccessOf("alice " + role + kTokenLine));
    Serve();
  }
  ServerSecurity SecurityOf(const std::string& daemon_name,
                            std::shared_ptr<const AccessControl> access) const {
    const CertificateFiles own = ca_->Issue(daemon_name);
    const auto tls = TlsContext::Load({own.certificate, own.key, ca_->certificate()});
    EXPECT_TRUE(tls.has_value()) << tls.error().message();
    return {*tls, std::move(access)};
  }
  BlockingPeer::Tls Anonymous() const { return {ca_->certificate()}; }
  BlockingPeer::Tls As(const std::string& name, const std::string& unit = "") const {
    return {ca_->certificate(), ca_->Issue(name, unit)};
  }
  static StatusCode Ask(BlockingPeer& peer, const wire::Envelope& request) {
    EXPECT_TRUE(peer.Send(request));
    const auto reply = peer.Receive();
    EXPECT_TRUE(reply.has_value());
    return CodeOf(reply);
  }
  wire::Envelope UploadBy(const std::string& vehicle) {
    UploadRequest upload = DriveUpload(0);
    upload.key.session.vehicle = vehicle;
    return UploadOf(std::move(upload), 3);
  }
  static wire::Envelope Retraction() {
    wire::Envelope envelope;
    envelope.set_request_id(4);
    envelope.mutable_change_session()->set_action(wire::ChangeSession::RETRACT);
    return envelope;
  }
  static wire::Envelope Verification() {
    wire::Envelope envelope;
    envelope.set_request_id(5);
    envelope.mutable_verify_request()->set_timeout_ms(10'000);
    return envelope;
  }

  std::unique_ptr<TestAuthority> ca_;
};

}  // namespace atlas
