#include "proto/wire/tile_body.h"

#include <cstdint>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "proto/wire/envelope.h"
#include "proto/wire/frame.h"

namespace atlas {
namespace {

Bytes FrameOf(const TileBody& body, std::uint64_t request_id) {
  const Bytes around = body.FrameAround(request_id);
  ByteWriter frame;
  frame.Raw(ByteSpan(around).first(kFrameHeaderBytes));
  frame.Raw(body.bytes());
  frame.Raw(ByteSpan(around).subspan(kFrameHeaderBytes));
  return frame.Take();
}

TEST(TileBodyTest, IsAFrameWithTheTileForAnyRequest) {
  for (const std::size_t size : {0u, 1u, 127u, 128u, 70'000u}) {
    const Bytes blob(size, 0xa5);
    const auto body = TileBody::Create({0x1234'5678'9abc'def0u, 77, ~std::uint64_t{0}, 0}, blob);
    ASSERT_TRUE(body.has_value());
    EXPECT_EQ(body->blob().size(), size);
    for (const std::uint64_t request_id :
         {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{300}, ~std::uint64_t{0}}) {
      FrameDecoder decoder;
      decoder.Push(FrameOf(*body, request_id));
      const auto payload = decoder.Next();
      ASSERT_TRUE(payload.has_value() && payload->has_value());
      const auto envelope = ParseEnvelope(**payload);
      ASSERT_TRUE(envelope.has_value());
      EXPECT_EQ(envelope->request_id(), request_id);
      EXPECT_EQ(envelope->tile().key(), 0x1234'5678'9abc'def0u);
      EXPECT_EQ(envelope->tile().revision(), 77u);
      EXPECT_EQ(envelope->tile().payload_hash(), ~std::uint64_t{0});
      EXPECT_EQ(envelope->tile().blob(), BytesToWire(blob));
    }
  }
}

TEST(TileBodyTest, RefusesWhatNoFrameHolds) {
  const auto body = TileBody::Create({1, 2, 3, 0}, Bytes(kMaxFrameBytes));
  ASSERT_FALSE(body.has_value());
  EXPECT_EQ(body.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
