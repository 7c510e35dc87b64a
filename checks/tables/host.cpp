// Runs a snippet that looks like C as C++. `host FOLDER` reads u.bin and each NAME.tables, the columns of a texture and its
// numbers, and writes NAME.samples: direction, density, radiance, and the density of a look-up in that direction.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

using namespace std;

struct float2 { float x, y; };
struct float4 { float x, y, z, w; };
struct float3 {
  float x, y, z;
  float3() = default;
  float3(float x, float y, float z) : x(x), y(y), z(z) {}
};

#if defined(DOMELIGHT_CUDA)
#define __device__
inline float3 make_float3(float x, float y, float z) { return {x, y, z}; }
#define TABLES tables,
#elif defined(DOMELIGHT_METAL)
#define device
#define thread
#define TABLES tables,
#else
template <class T> struct StructuredBuffer {
  const T* numbers;
  const T& operator[](int i) const { return numbers[i]; }
};
#define TABLES
#endif

#include "snippet"

namespace files = std::filesystem;

template <class T> static vector<T> read(const files::path& path, long skip = 0) {
  FILE* file = fopen(path.c_str(), "rb");
  if (!file) { perror(path.c_str()); exit(1); }
  vector<T> values((files::file_size(path) - skip) / sizeof(T));
  fseek(file, skip, SEEK_SET);
  if (fread(values.data(), sizeof(T), values.size(), file) != values.size()) exit(1);
  fclose(file);
  return values;
}

static bool draw(const vector<float2>& points, files::path path) {
  const vector<float4> groups = read<float4>(path, 4);
  const float4* tables = groups.data();
#if !defined(DOMELIGHT_CUDA) && !defined(DOMELIGHT_METAL)
  domelight_tables.numbers = tables;
#endif
  FILE* file = fopen(path.replace_extension("samples").c_str(), "wb");
  if (!file) return false;
  for (const float2 u : points) {
    const DomelightSample s = domelight_sample(TABLES u);
    const float3 d = s.direction, l = s.radiance;
    const float4 rows[2] = {{d.x, d.y, d.z, s.pdf}, {l.x, l.y, l.z, domelight_pdf(TABLES d)}};
    if (fwrite(rows, sizeof(rows), 1, file) != 1) return false;
  }
  return fclose(file) == 0;
}

int main(int, char** arguments) {
  const files::path folder = arguments[1];
  const vector<float2> points = read<float2>(folder / "u.bin");
  for (const auto& entry : files::directory_iterator(folder))
    if (entry.path().extension() == ".tables" && !draw(points, entry.path())) return 1;
  return 0;
}
