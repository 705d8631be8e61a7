#include "chain/gl/transfers.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "chain/gl/debug.h"
#include "chain/gl/half.h"

namespace postchain::gl {
namespace {

// The device takes a piece after the band before it (chain/gl/band_queue), of 40 ms: in that time
// this many are handed over.
constexpr size_t kPieces = 32;

// How a plane is laid out in a buffer.
struct Layout {
    int width, height, slices, channels;
    GLenum external, type;

    explicit Layout(const Storage& storage)
        : width(storage.width),
          height(storage.height),
          slices(std::max(storage.slices, 1)),
          channels(channels_of(storage.format)),
          external(external_format(storage.format)) {
        const Format format = storage.format;
        const bool half =
            format == Format::rgba16f || format == Format::rg16f || format == Format::r16f;
        const bool bits = format == Format::rgba32ui || format == Format::r32ui;
        type = half ? GL_HALF_FLOAT : bits ? GL_UNSIGNED_INT : GL_FLOAT;
    }
    int rows() const { return height * slices; }
    size_t row_values() const { return size_t(width) * size_t(channels); }
    size_t row_bytes() const { return row_values() * (type == GL_HALF_FLOAT ? 2 : 4); }
    // Rows of a piece that begins at this one: of one slice.
    int rows_of_piece(int first) const {
        const auto fit = int(PixelRing::kPieceBytes / row_bytes());
        return std::min(std::max(fit, 1), height - first % height);
    }
};

bool fits(const Upload& upload) {
    const Layout layout(*upload.texture);
    const ImageF& pixels = *upload.pixels;
    return pixels.width == layout.width && pixels.height == layout.rows() &&
           pixels.channels == layout.channels;
}

}  // namespace

PixelRing::~PixelRing() {
    if (buffer_) glDeleteBuffers(1, &buffer_);
}

Status PixelRing::make(bool plain) {
    if (memory_) return Status();
    constexpr GLbitfield kAccess =
        GL_MAP_READ_BIT | GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    constexpr auto kBytes = GLsizeiptr(kPieces * kPieceBytes);
    fences_.resize(plain ? 1 : kPieces);
    if (plain) {
        plain_.resize(kPieceBytes);
        memory_ = plain_.data();
        return Status();
    }
    glCreateBuffers(1, &buffer_);
    glNamedBufferStorage(buffer_, kBytes, nullptr, kAccess);
    memory_ = static_cast<std::byte*>(glMapNamedBufferRange(buffer_, 0, kBytes, kAccess));
    if (memory_) return Status();
    glDeleteBuffers(1, &buffer_);
    buffer_ = 0;
    return Status(StatusCode::memory, check_error("allocating buffers of pixels").message());
}

void Transfers::hand_over(Upload& upload) {
    const Texture& texture = *upload.texture;
    const Layout layout(texture);
    const int rows = layout.rows_of_piece(upload.row);
    const size_t number = next_up_++, values = size_t(rows) * layout.row_values();
    const float* from = upload.pixels->data.data() + size_t(upload.row) * layout.row_values();
    const void* place = up_.place(number);
    if (layout.type == GL_HALF_FLOAT)
        to_halves(from, reinterpret_cast<uint16_t*>(up_.piece(number)), values);
    else if (software_)
        place = from;
    else
        std::memcpy(up_.piece(number), from, values * sizeof(float));
    const int slice = upload.row / layout.height, y = upload.row % layout.height;
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, up_.buffer());
    if (texture.slices > 0)
        glTextureSubImage3D(texture.name, 0, 0, y, slice, layout.width, rows, 1, layout.external,
                            layout.type, place);
    else
        glTextureSubImage2D(texture.name, 0, 0, y, layout.width, rows, layout.external, layout.type,
                            place);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    if (!software_) up_.fence(number) = Fence::here();
    upload.row += rows;
}

bool Transfers::advance(Upload& upload) {
    if (!fits(upload) || upload.row >= upload.pixels->height) return false;
    if (!up_.make(software_).ok() || !up_.fence(next_up_).passed()) return false;
    hand_over(upload);
    return true;
}

Status Transfers::finish(Upload& upload) {
    if (!fits(upload))
        return Status(StatusCode::internal, "upload of an image that does not fit its texture");
    RETURN_IF_ERROR(up_.make(software_));
    while (upload.row < upload.pixels->height) {
        up_.fence(next_up_).wait();
        hand_over(upload);
    }
    return check_error("uploading a plane");
}

Status Transfers::upload(const Texture& texture, const ImageF& pixels) {
    Upload upload{&texture, &pixels};
    return finish(upload);
}

Result<ImageF> Transfers::download(unsigned texture, const Storage& storage,
                                   const Meanwhile& meanwhile) {
    RETURN_IF_ERROR(down_.make(software_));
    const Layout layout(storage);
    const int width = layout.width, height = layout.height;
    ImageF pixels(width, layout.rows(), layout.channels);
    const bool halves = layout.type == GL_HALF_FLOAT, direct = software_ && !halves;
    const auto row = [&](int number) {
        return pixels.data.data() + size_t(number) * layout.row_values();
    };
    int asked = 0, taken = 0;  // rows
    size_t next = next_down_;  // piece to take
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    while (taken < layout.rows()) {
        glBindBuffer(GL_PIXEL_PACK_BUFFER, down_.buffer());
        for (; asked < layout.rows() && next_down_ - next < down_.pieces(); ++next_down_) {
            const int rows = layout.rows_of_piece(asked);
            glGetTextureSubImage(texture, 0, 0, asked % height, asked / height, width, rows, 1,
                                 layout.external, layout.type, GLsizei(PixelRing::kPieceBytes),
                                 direct ? row(asked) : down_.place(next_down_));
            if (!software_) down_.fence(next_down_) = Fence::here();
            asked += rows;
        }
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
        const int rows = layout.rows_of_piece(taken);
        const size_t values = size_t(rows) * layout.row_values();
        down_.fence(next).wait(meanwhile);
        if (halves)
            from_halves(reinterpret_cast<const uint16_t*>(down_.piece(next)), row(taken), values);
        else if (!direct)
            std::memcpy(row(taken), down_.piece(next), values * sizeof(float));
        taken += rows;
        ++next;
    }
    if (layout.type == GL_UNSIGNED_INT)
        for (float& value : pixels.data) value = float(std::bit_cast<uint32_t>(value));
    RETURN_IF_ERROR(check_error("reading a plane back"));
    return pixels;
}

}  // namespace postchain::gl
