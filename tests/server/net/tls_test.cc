// Who comes in, over TLS and with tokens, and what they may do.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <future>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include "tests/server/net/tls_fixture.h"

namespace atlas {
namespace {

TEST_F(TlsTest, AVehicleIsWhomItsCertificateNames) {
  ServeTls();
  BlockingPeer car(port_, As("car.7"));
  ASSERT_TRUE(car.is_encrypted());
  EXPECT_EQ(car.PeerName(), "daemon");
  const wire::Envelope hello = car.Greet();
  EXPECT_EQ(hello.hello_reply().name(), "car.7");
  EXPECT_EQ(hello.hello_reply().role(), "vehicle");
  EXPECT_EQ(Ask(car, UploadBy("car.7")), StatusCode::kOk);
  EXPECT_EQ(Ask(car, UploadBy("car.8")), StatusCode::kPermissionDenied);
  EXPECT_EQ(Ask(car, Retraction()), StatusCode::kPermissionDenied);
  EXPECT_EQ(Ask(car, Verification()), StatusCode::kPermissionDenied);
  EXPECT_EQ(Ask(car, StatusOf(9)), StatusCode::kOk) << "and stays connected";
}

TEST_F(TlsTest, APoseIsCorrectedByItsVehicleAndByTheMerge) {
  ServeTls();
  BlockingPeer car(port_, As("car.7"));
  car.Greet();
  ASSERT_EQ(Ask(car, UploadBy("car.7")), StatusCode::kOk);
  wire::Envelope correction;
  correction.set_request_id(6);
  auto& update = *correction.mutable_update_poses()->add_updates();
  update.mutable_key()->CopyFrom(UploadBy("car.7").upload_keyframe().key());
  update.mutable_pose()->CopyFrom(UploadBy("car.7").upload_keyframe().pose());
  EXPECT_EQ(Ask(car, correction), StatusCode::kOk);
  BlockingPeer other(port_, As("car.8"));
  other.Greet();
  EXPECT_EQ(Ask(other, correction), StatusCode::kPermissionDenied);
  BlockingPeer merge(port_, As("aligner", "merge"));
  EXPECT_EQ(merge.Greet().hello_reply().role(), "merge");
  EXPECT_EQ(Ask(merge, correction), StatusCode::kOk);
  EXPECT_EQ(Ask(merge, UploadBy("aligner")), StatusCode::kPermissionDenied);
  EXPECT_EQ(Ask(merge, Verification()), StatusCode::kOk);
}

TEST_F(TlsTest, ATokenSaysWhoAPersonIs) {
  ServeTls("reader");
  BlockingPeer alice(port_, Anonymous());
  const wire::Envelope hello = alice.Greet(kProtocolMajor, "", "open sesame");
  EXPECT_EQ(hello.hello_reply().name(), "alice");
  EXPECT_EQ(hello.hello_reply().role(), "reader");
  EXPECT_EQ(Ask(alice, StatusOf(2)), StatusCode::kOk);
  EXPECT_EQ(Ask(alice, UploadBy("alice")), StatusCode::kPermissionDenied);
}

TEST_F(TlsTest, NobodyInParticularStaysOutside) {
  ServeTls();
  for (const char* token : {"", "open sesam"}) {
    BlockingPeer peer(port_, Anonymous());
    const wire::Envelope reply = peer.Greet(kProtocolMajor, "", token);
    EXPECT_EQ(CodeOf(reply), StatusCode::kPermissionDenied) << token;
    EXPECT_FALSE(reply.error().retry());
    EXPECT_TRUE(peer.IsClosed());
  }
}

TEST_F(TlsTest, ACertificateOfAnotherAuthorityOpensNothing) {
  ServeTls();
  const TestAuthority others(directory_, "others");
  BlockingPeer peer(port_, {ca_->certificate(), others.Issue("car.7")});
  // In TLS 1.3 the client may not know yet that it was refused.
  EXPECT_TRUE(!peer.is_encrypted() || peer.Greet().body_case() == wire::Envelope::BODY_NOT_SET);
  BlockingPeer good(port_, As("car.7"));
  EXPECT_TRUE(good.Greet().has_hello_reply());
}

TEST_F(TlsTest, ACertificateWithoutAUsefulNameOpensNothing) {
  ServeTls();
  BlockingPeer spaced(port_, As("a car"));
  EXPECT_EQ(CodeOf(spaced.Greet()), StatusCode::kPermissionDenied);
  BlockingPeer boss(port_, As("car.7", "boss"));
  EXPECT_EQ(CodeOf(boss.Greet()), StatusCode::kPermissionDenied);
}

TEST_F(TlsTest, WithoutTlsOrWithAnOldOneNobodyIsHeard) {
  ServeTls();
  BlockingPeer plain(port_);
  EXPECT_EQ(plain.Greet().body_case(), wire::Envelope::BODY_NOT_SET);
  EXPECT_TRUE(plain.IsClosed());
  BlockingPeer::Tls old = As("car.7");
  old.max_version = TLS1_2_VERSION;
  EXPECT_FALSE(BlockingPeer(port_, old).is_encrypted());
  BlockingPeer good(port_, As("car.7"));
  EXPECT_TRUE(good.Greet().has_hello_reply());
}

TEST_F(TlsTest, AHandshakeHasADeadline) {
  net_.handshake = std::chrono::milliseconds(100);
  ServeTls();
  BlockingPeer silent(port_);
  EXPECT_TRUE(silent.IsClosed());
  BlockingPeer half(port_);
  half.SendBytes(Bytes{0x16, 0x03, 0x01, 0x02, 0x00});  // a record's head, and no more
  EXPECT_TRUE(half.IsClosed());
}

TEST_F(TlsTest, AVisitThatSaidNothingCostsLessThanOneThatShookHands) {
  net_.tls_visits_per_s = 1;
  net_.silent_visits_per_s = 10'000;
  ServeTls();
  const auto time_to_come = [this] {
    const auto began = std::chrono::steady_clock::now();
    EXPECT_TRUE(BlockingPeer(port_, Anonymous()).is_encrypted());
    return std::chrono::steady_clock::now() - began;
  };
  for (int i = 0; i < 300; ++i) {
    BlockingPeer silent(port_);
  }
  EXPECT_LT(time_to_come(), std::chrono::seconds(10)) << "not 300 times what may wait";
  std::chrono::steady_clock::duration slowest{};
  for (int i = 0; i < 4; ++i) {
    slowest = std::max(slowest, time_to_come());
  }
  EXPECT_GT(slowest, std::chrono::milliseconds(50));
}

TEST_F(TlsTest, LargeRepliesComeWholeThroughSmallBuffers) {
  ServeTls();
  UploadDrive(12);
  Digest();
  BlockingPeer slow(port_, As("car.7"), 4'096);
  slow.Greet();
  constexpr std::uint64_t kQueries = 40;
  auto sending = std::async(std::launch::async, [&slow] {
    for (std::uint64_t id = 1; id <= kQueries; ++id) {
      slow.Send(QueryOf(id));
    }
  });
  sending.get();
  std::uint64_t ended = 0;
  while (ended < kQueries) {
    const auto reply = slow.Receive();
    ASSERT_TRUE(reply.has_value());
    ended += reply->has_query_end() ? 1u : 0u;
  }
}

TEST_F(TlsTest, ATokenThatIsTakenBackClosesItsConnections) {
  ServeTls();
  BlockingPeer alice(port_, Anonymous());
  ASSERT_TRUE(alice.Greet(kProtocolMajor, "", "open sesame").has_hello_reply());
  BlockingPeer car(port_, As("car.7"));
  ASSERT_TRUE(car.Greet().has_hello_reply());
  server_->ChangeSecurity(SecurityOf("renewed", AccessOf("")));
  EXPECT_TRUE(alice.IsClosed());
  EXPECT_EQ(Ask(car, StatusOf(1)), StatusCode::kOk);
  BlockingPeer again(port_, Anonymous());
  EXPECT_EQ(again.PeerName(), "renewed") << "the new certificate";
  EXPECT_EQ(CodeOf(again.Greet(kProtocolMajor, "", "open sesame")), StatusCode::kPermissionDenied);
}

TEST_F(TlsTest, ACertificateThatIsTakenBackClosesItsConnectionsAndOpensNothing) {
  ServeTls();
  const CertificateFiles stolen = ca_->Issue("car.7");
  BlockingPeer thief(port_, {ca_->certificate(), stolen});
  ASSERT_TRUE(thief.Greet().has_hello_reply());
  BlockingPeer car(port_, As("car.8"));
  ASSERT_TRUE(car.Greet().has_hello_reply());
  ca_->Revoke(stolen);
  server_->ChangeSecurity(SecurityOf("renewed", security_.access));
  EXPECT_TRUE(thief.IsClosed());
  EXPECT_EQ(Ask(car, StatusOf(1)), StatusCode::kOk);
  BlockingPeer again(port_, {ca_->certificate(), stolen});
  EXPECT_EQ(again.Greet().body_case(), wire::Envelope::BODY_NOT_SET);
  BlockingPeer other(port_, As("car.9"));
  EXPECT_TRUE(other.Greet().has_hello_reply());
}

// The vehicle's own certificate is on no list: that of its authority is, on the list of the one
// above.
TEST_F(TlsTest, AnAuthorityInBetweenThatIsTakenBackTakesItsVehiclesWithIt) {
  ServeTls();
  const TestAuthority stolen(directory_, "stolen", ca_.get());
  const TestAuthority good(directory_, "good", ca_.get());
  const auto admit = [&] {
    std::ofstream all(directory_ / "all.pem");
    for (const auto& file : {ca_->certificate(), stolen.certificate(), good.certificate()}) {
      all << std::ifstream(file).rdbuf();
    }
    all.close();
    const CertificateFiles own = ca_->Issue("daemon");
    const auto tls = TlsContext::Load({own.certificate, own.key, directory_ / "all.pem"});
    ASSERT_TRUE(tls) << tls.error().message();
    server_->ChangeSecurity({*tls, security_.access});
  };
  admit();
  BlockingPeer thief(port_, {ca_->certificate(), stolen.Issue("car.7")});
  ASSERT_TRUE(thief.Greet().has_hello_reply());
  BlockingPeer car(port_, {ca_->certificate(), good.Issue("car.8")});
  ASSERT_TRUE(car.Greet().has_hello_reply());
  ca_->Revoke({stolen.certificate(), {}});
  for (const TestAuthority* between : {&stolen, &good}) {
    between->Revoke(between->Issue("scrapped"));
  }
  admit();
  EXPECT_TRUE(thief.IsClosed());
  EXPECT_EQ(Ask(car, StatusOf(1)), StatusCode::kOk);
  BlockingPeer again(port_, {ca_->certificate(), stolen.Issue("car.9")});
  EXPECT_EQ(again.Greet().body_case(), wire::Envelope::BODY_NOT_SET);
}

TEST_F(TlsTest, WhoeverIsTakenBackBeforeItsGreetingStaysOutside) {
  ServeTls();
  const CertificateFiles stolen = ca_->Issue("car.7");
  BlockingPeer thief(port_, {ca_->certificate(), stolen});
  BlockingPeer car(port_, As("car.8"));
  ASSERT_TRUE(thief.is_encrypted());
  ca_->Revoke(stolen);
  server_->ChangeSecurity(SecurityOf("renewed", security_.access));
  const BlockingPeer marker(port_, As("car.9"));
  ASSERT_EQ(marker.PeerName(), "renewed") << "accepted after the change";
  EXPECT_EQ(CodeOf(thief.Greet()), StatusCode::kPermissionDenied);
  EXPECT_TRUE(thief.IsClosed());
  EXPECT_TRUE(car.Greet().has_hello_reply());
}

TEST_F(TlsTest, WhoeverExpiresIsClosed) {
  net_.identity_check = std::chrono::milliseconds(50);
  ServeTls();
  std::string dated = std::string("alice admin") + kTokenLine;
  dated.replace(dated.find("never"), 5, "2099-12-31");
  server_->ChangeSecurity({security_.tls, AccessOf(dated)});
  BlockingPeer alice(port_, Anonymous());
  ASSERT_TRUE(alice.Greet(kProtocolMajor, "", "open sesame").has_hello_reply());
  BlockingPeer car(port_, As("car.7"));
  ASSERT_TRUE(car.Greet().has_hello_reply());
  now_ms_ = std::int64_t{4'102'444'800'000};  // the next day begins
  EXPECT_TRUE(alice.IsClosed());
  EXPECT_EQ(Ask(car, StatusOf(1)), StatusCode::kOk);
}

TEST_F(TlsTest, AnAuthorityThatIsTakenBackTakesItsVehiclesWithIt) {
  ServeTls();
  BlockingPeer car(port_, As("car.7"));
  ASSERT_TRUE(car.Greet().has_hello_reply());
  BlockingPeer alice(port_, Anonymous());
  ASSERT_TRUE(alice.Greet(kProtocolMajor, "", "open sesame").has_hello_reply());
  const TestAuthority other(directory_, "other");
  const CertificateFiles own = ca_->Issue("daemon");
  server_->ChangeSecurity(
      {TlsContext::Load({own.certificate, own.key, other.certificate()}).value(),
       security_.access});
  EXPECT_TRUE(car.IsClosed());
  EXPECT_EQ(Ask(alice, StatusOf(1)), StatusCode::kOk) << "a token needs no certificate";
}

TEST_F(TlsTest, ARoleThatChangedHoldsAtOnce) {
  ServeTls("reader");
  BlockingPeer alice(port_, Anonymous());
  ASSERT_TRUE(alice.Greet(kProtocolMajor, "", "open sesame").has_hello_reply());
  EXPECT_EQ(Ask(alice, Verification()), StatusCode::kPermissionDenied);
  server_->ChangeSecurity({security_.tls, AccessOf(std::string("alice admin") + kTokenLine)});
  BlockingPeer marker(port_, Anonymous());  // accepted after the change
  marker.Greet(kProtocolMajor, "", "open sesame");
  EXPECT_EQ(Ask(alice, Verification()), StatusCode::kOk);
}

// Else it would be one name to its limits and to the atlas's log, and another to its rights.
TEST_F(TlsTest, WhoseNameChangedComesAgain) {
  ServeTls("reader");
  BlockingPeer alice(port_, Anonymous());
  ASSERT_TRUE(alice.Greet(kProtocolMajor, "", "open sesame").has_hello_reply());
  server_->ChangeSecurity({security_.tls, AccessOf(std::string("alicia reader") + kTokenLine)});
  EXPECT_TRUE(alice.IsClosed());
  BlockingPeer again(port_, Anonymous());
  EXPECT_EQ(again.Greet(kProtocolMajor, "", "open sesame").hello_reply().name(), "alicia");
}

TEST_F(TlsTest, ANameHasSoManyConnectionsAndOthersHaveTheirOwn) {
  net_.of_name.connections = 2;
  ServeTls();
  BlockingPeer first(port_, As("car.7"));
  first.Greet();
  {
    BlockingPeer second(port_, As("car.7"));
    EXPECT_TRUE(second.Greet().has_hello_reply());
    BlockingPeer third(port_, As("car.7"));
    const wire::Envelope refused = third.Greet();
    EXPECT_EQ(CodeOf(refused), StatusCode::kUnavailable);
    EXPECT_TRUE(refused.error().retry());
    EXPECT_TRUE(third.IsClosed());
    BlockingPeer other(port_, As("car.8"));
    EXPECT_TRUE(other.Greet().has_hello_reply());
    second.CloseSending();
    EXPECT_TRUE(second.IsClosed());
  }
  BlockingPeer again(port_, As("car.7"));
  EXPECT_TRUE(again.Greet().has_hello_reply()) << "the place is free again";
}

TEST_F(TlsTest, WhatANameMayHaveChangesForThoseWhoAreThere) {
  net_.of_name.connections = 1;
  ServeTls();
  BlockingPeer first(port_, As("car.7"));
  first.Greet();
  BlockingPeer refused(port_, As("car.7"));
  EXPECT_EQ(CodeOf(refused.Greet()), StatusCode::kUnavailable);
  NameLimits wider;
  wider.connections = 2;
  server_->ChangeNameLimits(wider);
  BlockingPeer second(port_, As("car.7"));
  EXPECT_TRUE(second.Greet().has_hello_reply());
}

TEST_F(TlsTest, WhoeverAsksTooOftenWaitsAndTheOthersDoNot) {
  net_.of_name.requests_per_s = 20;
  net_.frame = std::chrono::milliseconds(100);  // waiting is no fault of the peer
  ServeTls();
  BlockingPeer eager(port_, As("car.7"));
  eager.Greet();
  const auto begin = std::chrono::steady_clock::now();
  Bytes all;
  constexpr std::uint64_t kRequests = 40;
  for (std::uint64_t id = 1; id <= kRequests; ++id) {
    const Bytes frame = EncodeEnvelopeFrame(StatusOf(id)).value();
    all.insert(all.end(), frame.begin(), frame.end());
  }
  eager.SendBytes(all);
  for (std::uint64_t id = 1; id <= kRequests; ++id) {
    ASSERT_TRUE(eager.Receive().has_value());
  }
  BlockingPeer calm(port_, As("car.8"));
  calm.Greet();
  EXPECT_EQ(Ask(calm, StatusOf(1)), StatusCode::kOk);
  // 40 at once are 20 too many: a second in which nothing more is read.
  EXPECT_EQ(Ask(eager, StatusOf(99)), StatusCode::kOk);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(900));
}

TEST_F(TlsTest, WhoeverComesAgainGoesOnFromWhereItWas) {
  net_.of_name.requests_per_s = 20;
  ServeTls();
  const auto begin = std::chrono::steady_clock::now();
  for (int visit = 0; visit < 6; ++visit) {
    BlockingPeer eager(port_, As("car.7"));
    eager.Greet();
    for (std::uint64_t id = 1; id <= 10; ++id) {
      ASSERT_EQ(Ask(eager, StatusOf(id)), StatusCode::kOk);
    }
  }
  // 66 with the greetings: 46 more than a second's.
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1'500));
}

TEST_F(TlsTest, FilesThatAreOfNoUseAreNamed) {
  ca_ = std::make_unique<TestAuthority>(directory_, "fleet");
  const CertificateFiles one = ca_->Issue("one");
  const CertificateFiles two = ca_->Issue("two");
  const auto missing = TlsContext::Load({directory_ / "none.pem", one.key, {}});
  EXPECT_EQ(missing.error().code(), StatusCode::kNotFound);
  EXPECT_THAT(missing.error().message(), ::testing::HasSubstr("none.pem"));
  const auto mixed = TlsContext::Load({one.certificate, two.key, {}});
  EXPECT_EQ(mixed.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(mixed.error().message(), ::testing::HasSubstr("two.key"));
  const auto no_authority = TlsContext::Load({one.certificate, one.key, one.key});
  EXPECT_EQ(no_authority.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
