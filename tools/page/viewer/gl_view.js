// Draws a view with WebGL2.
import { by_id } from "../shared/dom.js";
import { taps_of } from "./cpu_view.js";
import { kMagma } from "./magma.js";

const kTextureBytes = 512 * 2 ** 20;

export class GlView {
    // Undefined without WebGL2, or if a texture cannot have `side` pixels.
    static create(canvas, side) {
        const gl = canvas.getContext("webgl2", {
            alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true,
        });
        if (!gl || gl.getParameter(gl.MAX_TEXTURE_SIZE) < side) return undefined;
        try {
            return new GlView(gl);
        } catch (error) {
            console.warn(error);
            return undefined;
        }
    }

    constructor(gl) {
        this.name = "WebGL2";
        this.gl = gl;
        this.textures = new Map();  // picture name -> {texture, bytes}, oldest use first
        this.#build();
        gl.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
        gl.canvas.addEventListener("webglcontextrestored", () => {
            this.textures.clear();
            this.#build();
            this.on_restored?.();
        });
    }

    #build() {
        const gl = this.gl;
        const program = gl.createProgram();
        for (const [type, id] of [[gl.VERTEX_SHADER, "view.vert"],
            [gl.FRAGMENT_SHADER, "view.frag"]]) {
            const shader = gl.createShader(type);
            gl.shaderSource(shader, by_id(id).textContent);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost())
                throw new Error(gl.getShaderInfoLog(shader));
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
            throw new Error(gl.getProgramInfoLog(program));
        gl.useProgram(program);
        this.at = (name) => gl.getUniformLocation(program, name);
        ["picture", "error", "magma", "other"].forEach(
            (name, unit) => gl.uniform1i(this.at(name), unit));
        gl.bindVertexArray(gl.createVertexArray());
        this.blank = this.#texture(gl.R8, 1, 1, gl.RED, gl.UNSIGNED_BYTE, new Uint8Array(1));
        gl.activeTexture(gl.TEXTURE2);
        this.#texture(gl.RGBA8, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, kMagma);
    }

    #texture(internal, width, height, format, type, data) {
        const gl = this.gl;
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
        gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, data);
        for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST],
            [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
            [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, key, value);
        return texture;
    }

    #bind(unit, image) {
        const gl = this.gl;
        gl.activeTexture(gl.TEXTURE0 + unit);
        if (!image) return gl.bindTexture(gl.TEXTURE_2D, this.blank);
        let held = this.textures.get(image.name);
        if (held) {
            gl.bindTexture(gl.TEXTURE_2D, held.texture);
            this.textures.delete(image.name);
        } else {
            const { width, height, bits, data } = image;
            const texture = bits === 16
                ? this.#texture(gl.RGB16F, width, height, gl.RGB, gl.HALF_FLOAT, data)
                : this.#texture(gl.R8, width, height, gl.RED, gl.UNSIGNED_BYTE, data);
            held = { texture, bytes: data.byteLength };
        }
        this.textures.set(image.name, held);
    }

    #evict() {
        let bytes = 0;
        for (const held of this.textures.values()) bytes += held.bytes;
        for (const [name, held] of this.textures) {
            if (bytes <= kTextureBytes || this.textures.size <= 3) break;
            bytes -= held.bytes;
            this.gl.deleteTexture(held.texture);
            this.textures.delete(name);
        }
    }

    // view: {image, center: [x, y], scale, gain, tone, background: [r, g, b] of 0..1, grid,
    // error: its map, which is drawn in its place; size: [width, height] of the frame, which all
    // of these cover; other: the picture left of `split`, device pixels}
    draw(view) {
        const gl = this.gl;
        const { width, height } = gl.canvas;
        gl.viewport(0, 0, width, height);
        this.#bind(0, view.image);
        this.#bind(1, view.error);
        this.#bind(3, view.other);
        this.#evict();
        gl.uniform2f(this.at("canvas"), width, height);
        gl.uniform2f(this.at("center"), ...view.center);
        gl.uniform1f(this.at("scale"), view.scale);
        gl.uniform1f(this.at("gain"), view.gain);
        gl.uniform1i(this.at("tone"), view.tone);
        gl.uniform1i(this.at("map"), view.error ? 1 : 0);
        gl.uniform3f(this.at("background"), ...view.background);
        gl.uniform1i(this.at("grid"), view.grid ? 1 : 0);
        gl.uniform2f(this.at("size"), ...view.size);
        gl.uniform1f(this.at("split"), view.split);
        gl.uniform1i(this.at("n"), taps_of(view.scale));
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    // RGB, 0..255, of a device pixel counted from the top left.
    read(x, y) {
        const out = new Uint8Array(4);
        this.gl.readPixels(x, this.gl.canvas.height - 1 - y, 1, 1, this.gl.RGBA,
            this.gl.UNSIGNED_BYTE, out);
        return [...out.slice(0, 3)];
    }
}
