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

// Published in docs/protocol.md.
TEST(EnvelopeTest, GoldenSyncFrame) {
  wire::Envelope envelope;
  envelope.set_request_id(2);
  wire::SyncRequest& sync = *envelope.mutable_sync_request();
  wire::Area::Disc& disc = *sync.mutable_area()->mutable_disc();
  disc.mutable_center()->set_x_um(1'500'000);
  disc.mutable_center()->set_y_um(-2'000'000);
  disc.set_radius_um(100'000'000);
  sync.add_sections(2);
  sync.set_budget_bytes(65'536);
  wire::Held& held = *sync.add_held();
  held.add_keys(0x0300'0000'0000'0000);
  held.add_payload_hashes(0x1122'3344'5566'7788);
  const Bytes golden = {0x52, 0x41, 0x46, 0x31, 0x37, 0x00, 0x00, 0x00, 0xc9, 0x12, 0xe4, 0xc1,
                        0x08, 0x02, 0xd2, 0x01, 0x32, 0x0a, 0x13, 0x0a, 0x11, 0x0a, 0x0a, 0x08,
                        0xc0, 0x8d, 0xb7, 0x01, 0x10, 0xff, 0x91, 0xf4, 0x01, 0x10, 0x80, 0xc2,
                        0xd7, 0x2f, 0x22, 0x01, 0x02, 0x2a, 0x14, 0x12, 0x08, 0x00, 0x00, 0x00,
                        0x00, 0x00, 0x00, 0x00, 0x03, 0x1a, 0x08, 0x88, 0x77, 0x66, 0x55, 0x44,
                        0x33, 0x22, 0x11, 0x30, 0x80, 0x80, 0x04};
  EXPECT_EQ(EncodeEnvelopeFrame(envelope).value(), golden);
}

TEST(EnvelopeTest, GoldenWatchFrame) {
  wire::Envelope envelope;
  envelope.set_request_id(3);
  wire::WatchRequest& watch = *envelope.mutable_watch_request();
  wire::Area::Disc& disc = *watch.mutable_area()->mutable_disc();
  disc.mutable_center()->set_x_um(1'500'000);
  disc.mutable_center()->set_y_um(-2'000'000);
  disc.set_radius_um(100'000'000);
  watch.set_interval_ms(1'000);
  const Bytes golden = {0x52, 0x41, 0x46, 0x31, 0x1d, 0x00, 0x00, 0x00, 0xe6, 0x01, 0xaf,
                        0x18, 0x08, 0x03, 0xea, 0x01, 0x18, 0x0a, 0x13, 0x0a, 0x11, 0x0a,
                        0x0a, 0x08, 0xc0, 0x8d, 0xb7, 0x01, 0x10, 0xff, 0x91, 0xf4, 0x01,
                        0x10, 0x80, 0xc2, 0xd7, 0x2f, 0x20, 0xe8, 0x07};
  EXPECT_EQ(EncodeEnvelopeFrame(envelope).value(), golden);
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

// A byte each on the wire, four or eight in memory.
TEST(EnvelopeTest, CapsPackedNumbersToo) {
  const auto code_of = [](std::uint32_t sections, std::uint32_t revisions) {
    wire::Envelope envelope;
    envelope.mutable_query_region()->mutable_sections()->Resize(static_cast<int>(sections), 1);
    const std::string query = envelope.SerializeAsString();
    envelope.mutable_sync_manifest()->mutable_revisions()->Resize(static_cast<int>(revisions), 1);
    const std::string manifest = envelope.SerializeAsString();
    Bytes payload(query.begin(), query.end());
    payload.insert(payload.end(), manifest.begin(), manifest.end());
    return ParseCode(payload);
  };
  EXPECT_EQ(code_of(kMaxRepeatedFields - 1, 0), StatusCode::kOk);  // the field counts as one
  EXPECT_EQ(code_of(kMaxRepeatedFields, 0), StatusCode::kInvalidData);
  EXPECT_EQ(code_of(0, kMaxRepeatedFields), StatusCode::kInvalidData);
  EXPECT_EQ(code_of(kMaxRepeatedFields / 2, kMaxRepeatedFields / 2), StatusCode::kInvalidData);
}

// What a client may hold and ask for at most is in no envelope too much.
TEST(EnvelopeTest, PackedKeysAreNotCounted) {
  wire::Envelope envelope;
  for (int i = 0; i < 2; ++i) {
    envelope.mutable_sync_request()->add_held()->mutable_keys()->Resize(kMaxRepeatedFields, 7);
  }
  const std::string text = envelope.SerializeAsString();
  EXPECT_EQ(ParseCode(Bytes(text.begin(), text.end())), StatusCode::kOk);
}

TEST(EnvelopeTest, RefusesPackedNumbersThatAreCut) {
  const Bytes sections = {0x4A, 0x04, 0x32,
                          0x02, 0x01, 0x80};  // query_region, sections: 1 and half
  EXPECT_EQ(ParseCode(sections), StatusCode::kInvalidData);
}

TEST(EnvelopeTest, AKeyframeIsSmallButForItsBlob) {
  const auto payload_of = [](const wire::Envelope& envelope) {
    Bytes frame = EncodeEnvelopeFrame(envelope).value();
    return Bytes(frame.begin() + kFrameHeaderBytes, frame.end());
  };
  wire::Envelope envelope;
  envelope.set_request_id(3);
  envelope.mutable_upload_keyframe()->mutable_key()->set_vehicle("bus");
  envelope.mutable_upload_keyframe()->set_blob(std::string(100'000, 'x'));
  EXPECT_TRUE(IsSmallBesidesBlobs(payload_of(envelope), 100));
  EXPECT_FALSE(IsSmallBesidesBlobs(payload_of(envelope), 5));
  Bytes cut = payload_of(envelope);
  cut.pop_back();
  EXPECT_FALSE(IsSmallBesidesBlobs(cut, 100));
  // Bytes of other kinds count, known or not, one long field or many.
  wire::Envelope named = envelope;
  named.mutable_upload_keyframe()->mutable_key()->set_vehicle(std::string(200, 'x'));
  EXPECT_FALSE(IsSmallBesidesBlobs(payload_of(named), 100));
  wire::Envelope held;
  for (std::uint64_t i = 0; i < 100; ++i) {
    held.mutable_sync_request()->add_held()->add_keys(i);
  }
  EXPECT_FALSE(IsSmallBesidesBlobs(payload_of(held), 100));
  wire::Envelope packed;
  packed.mutable_sync_request()->add_held();
  for (std::uint64_t i = 0; i < 200; ++i) {
    packed.mutable_sync_request()->mutable_held(0)->add_keys(i);
  }
  EXPECT_FALSE(IsSmallBesidesBlobs(payload_of(packed), 100));
  Bytes unknown = payload_of(envelope);
  unknown.insert(unknown.end(), {0xFA, 0x3F, 200, 1});  // field 1023, 200 bytes
  unknown.insert(unknown.end(), 200, 7);
  EXPECT_TRUE(ParseEnvelope(unknown).has_value());
  EXPECT_FALSE(IsSmallBesidesBlobs(unknown, 100));
}

TEST(EnvelopeTest, IgnoresAndDropsAFewUnknownFields) {
  const Bytes unknown = {0xF8, 0x07, 0x01};  // field 127, varint 1
  const auto envelope = ParseEnvelope(Repeat(unknown, 10));
  ASSERT_TRUE(envelope.has_value()) << envelope.error().message();
  EXPECT_EQ(envelope->ByteSizeLong(), 0u);
  EXPECT_EQ(envelope->body_case(), wire::Envelope::BODY_NOT_SET);
  EXPECT_EQ(ParseCode(Repeat(unknown, kMaxUnknownFields + 1)), StatusCode::kInvalidData);
}

// Whatever the schema says of the number: as text where a number belongs, and within a body.
TEST(EnvelopeTest, DropsUnknownFieldsWhereverTheyAre) {
  const Bytes id_as_text = {1 << 3 | 2, 3, 'a', 'b', 'c'};
  for (const Bytes& payload : {id_as_text, EnvelopeWithPoses({0xF8, 0x07, 0x01})}) {
    const auto envelope = ParseEnvelope(payload);
    ASSERT_TRUE(envelope.has_value()) << envelope.error().message();
    EXPECT_LE(envelope->ByteSizeLong(), 2u) << "no more than an empty body";
  }
  EXPECT_EQ(ParseCode(Repeat(id_as_text, kMaxUnknownFields + 1)), StatusCode::kInvalidData);
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
