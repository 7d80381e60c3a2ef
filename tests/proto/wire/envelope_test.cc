// Envelopes: round trips, and payloads made to exhaust whoever parses them.
#include "proto/wire/envelope.h"

#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

// Field 7 (UpdatePoses) of an Envelope, holding `body`.
Bytes EnvelopeWithPoses(const Bytes& body) {
  ByteWriter out;
  out.U8(7 << 3 | 2);
  out.Varint(body.size());
  out.Raw(body);
  return out.Take();
}

Bytes Repeat(const Bytes& unit, std::size_t count) {
  Bytes result;
  for (std::size_t i = 0; i < count; ++i) {
    result.insert(result.end(), unit.begin(), unit.end());
  }
  return result;
}

StatusCode ParseCode(const Bytes& payload) {
  const auto envelope = ParseEnvelope(payload);
  return envelope ? StatusCode::kOk : envelope.error().code();
}

TEST(EnvelopeTest, RoundTripsThroughAFrame) {
  wire::Envelope envelope;
  envelope.set_request_id(42);
  envelope.mutable_tile()->set_key(0x0123456789abcdef);
  envelope.mutable_tile()->set_blob(std::string("\0\1\2", 3));
  const Bytes frame = EncodeEnvelopeFrame(envelope).value();
  FrameDecoder decoder;
  decoder.Push(frame);
  const auto payload = decoder.Next();
  ASSERT_TRUE(payload.has_value() && payload->has_value());
  const auto parsed = ParseEnvelope(**payload);
  ASSERT_TRUE(parsed.has_value()) << parsed.error().message();
  EXPECT_EQ(parsed->SerializeAsString(), envelope.SerializeAsString());
}

TEST(EnvelopeTest, RefusesTruncation) {
  wire::Envelope envelope;
  envelope.mutable_hello()->set_client_name("a name");
  const std::string text = envelope.SerializeAsString();
  for (std::size_t size = 1; size < text.size(); ++size) {
    EXPECT_EQ(ParseCode(Bytes(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size))),
              StatusCode::kInvalidData)
        << size;
  }
}

TEST(EnvelopeTest, RefusesGroups) {
  EXPECT_EQ(ParseCode({100 << 1 | 3}), StatusCode::kInvalidData);
  EXPECT_EQ(ParseCode(Repeat({0x0B}, 100)), StatusCode::kInvalidData);  // field 1, start group
}

TEST(EnvelopeTest, CapsRepeatedElements) {
  const Bytes empty_update = {0x0A, 0x00};
  EXPECT_EQ(ParseCode(EnvelopeWithPoses(Repeat(empty_update, 1000))), StatusCode::kOk);
  EXPECT_EQ(ParseCode(EnvelopeWithPoses(Repeat(empty_update, kMaxRepeatedFields + 1))),
            StatusCode::kInvalidData);
}

TEST(EnvelopeTest, CapsElementsSpreadOverSeveralBodies) {
  const Bytes half = EnvelopeWithPoses(Repeat({0x0A, 0x00}, kMaxRepeatedFields / 2 + 1));
  EXPECT_EQ(ParseCode(half), StatusCode::kOk);
  EXPECT_EQ(ParseCode(Repeat(half, 2)), StatusCode::kInvalidData);
}

TEST(EnvelopeTest, IgnoresAndDropsAFewUnknownFields) {
  const Bytes unknown = {0xF8, 0x07, 0x01};  // field 127, varint 1
  const auto envelope = ParseEnvelope(Repeat(unknown, 10));
  ASSERT_TRUE(envelope.has_value()) << envelope.error().message();
  EXPECT_EQ(envelope->ByteSizeLong(), 0u);
  EXPECT_EQ(envelope->body_case(), wire::Envelope::BODY_NOT_SET);
  EXPECT_EQ(ParseCode(Repeat(unknown, kMaxUnknownFields + 1)), StatusCode::kInvalidData);
}

TEST(EnvelopeTest, RefusesAMessageLargerThanAFrame) {
  wire::Envelope envelope;
  envelope.mutable_tile()->set_blob(std::string(kMaxFrameBytes, 'x'));
  const auto frame = EncodeEnvelopeFrame(envelope);
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
