// Meshes from files, good and bad.
#include "core/simulation/mesh/obj_reader.h"

#include <string>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

ObjMesh Parse(std::string_view text) {
  return ParseObj(text, "world.obj").value();
}

void ExpectRefused(std::string_view text, std::string_view word) {
  const auto mesh = ParseObj(text, "world.obj");
  ASSERT_FALSE(mesh.has_value()) << text;
  EXPECT_EQ(mesh.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(mesh.error().message().find("world.obj"), std::string::npos);
  EXPECT_NE(mesh.error().message().find(word), std::string::npos) << mesh.error().message();
}

constexpr std::string_view kSquare = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n";

TEST(ObjReaderTest, CutsPolygonsAsFans) {
  const ObjMesh obj = Parse(std::string(kSquare) + "f 1 2 3 4\n");
  ASSERT_EQ(obj.mesh.triangles.size(), 2U);
  EXPECT_EQ(obj.mesh.triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(obj.mesh.labels.size(), 2U);
}

TEST(ObjReaderTest, ReadsEveryFormOfCornersAndSkipsTheRest) {
  const ObjMesh obj = Parse(
      "mtllib a.mtl\r\n# a comment\r\no thing\r\nv  0 0 +0 1.0\r\nv 2 0 0\t# another\r\nv 2 2e0 "
      "0\r\n"
      "vt 0 0\r\nvn 0 0 1\r\nusemtl red\r\ns off\r\nf 1 2 3\r\nf 1/1 2/1 3/1\r\nf 1//1 2//1 "
      "3//1\r\n"
      "f 1/1/1 2/1/1 3/1/1\r\nf -3 -2 -1");
  ASSERT_EQ(obj.mesh.triangles.size(), 5U);
  for (const auto& triangle : obj.mesh.triangles) {
    EXPECT_EQ(triangle, obj.mesh.triangles[0]);
  }
}

TEST(ObjReaderTest, ABackslashGoesOnInTheNextLine) {
  const ObjMesh obj = Parse(std::string(kSquare) + "f 1 2 \\\r\n3 \\\n 4\n# a comment \\\nf 1 2 3");
  EXPECT_EQ(obj.mesh.triangles.size(), 3U);
  ExpectRefused(std::string(kSquare) + "f 1 2 \\\n 3\nf 1 2 9", "line 7");
}

TEST(ObjReaderTest, FarMeshesKeepTheirPrecision) {
  const ObjMesh obj = Parse(
      "v 4000000.125 5000000.25 100.5\nv 4000010.125 5000000.25 100.5\nv 4000010.125 5000010.25 "
      "100.5\nf 1 2 3");
  const Eigen::Vector3d corner = obj.origin_m + obj.mesh.vertices[0].cast<double>();
  EXPECT_NEAR((corner - Eigen::Vector3d(4000000.125, 5000000.25, 100.5)).norm(), 0.0, 1e-5);
  EXPECT_LT(obj.mesh.vertices[0].norm(), 20.0F);
}

TEST(ObjReaderTest, NamesTheLineOfABadCorner) {
  ExpectRefused(std::string(kSquare) + "f 1 2 5\n", "line 5");
  ExpectRefused(std::string(kSquare) + "f 1 2 0\n", "line 5");
  ExpectRefused(std::string(kSquare) + "f 1 2 -5\n", "'-5'");
  ExpectRefused(std::string(kSquare) + "f 1 2 x\n", "'x'");
  ExpectRefused(std::string(kSquare) + "f 1 2 99999999999999999999\n", "line 5");
  ExpectRefused(std::string(kSquare) + "f 1 2.5 3\n", "'2.5'");
}

TEST(ObjReaderTest, RefusesWhatIsNoCoordinate) {
  for (const char* word : {"nan", "inf", "1e9", "abc", "1e999", "1,5"}) {
    ExpectRefused(StrCat("v 0 0 0\nv 0 ", word, " 0\nf 1 1 1\n"), "line 2");
  }
  ExpectRefused("v 0 0\n", "line 1");
}

TEST(ObjReaderTest, RefusesTruncatedAndEmptyFiles) {
  ExpectRefused("", "no face");
  ExpectRefused(kSquare, "no face");
  ExpectRefused(std::string(kSquare) + "f 1 2", "2 corners");
  ExpectRefused(std::string("\0\x7f"
                            "ELF\n\xff\xfe",
                            8),
                "no face");
}

TEST(ObjReaderTest, RefusesAMeshTooLargeForItsNumbers) {
  ExpectRefused("v 0 0 0\nv 50000 0 0\nv 0 1 0\nf 1 2 3\n", "50000 m");
}

TEST(ObjReaderTest, AMissingFileIsNotFound) {
  EXPECT_EQ(ReadObj("/nowhere/world.obj").error().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace atlas
