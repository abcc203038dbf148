// Bytes that the page holds, and the container of a .glb.

const GLB_MAGIC = 0x46546c67;
const CHUNK_JSON = 0x4e4f534a;
const CHUNK_BINARY = 0x004e4942;

/** The bytes of an element of the page that holds them in base64. */
function embeddedBytes(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks its part ${id}: it was cut or changed`);
  const bytes = decodeBase64(element.textContent.trim());
  element.remove(); // the text is as large as the bytes, and needed no more
  return bytes;
}

/** What was packed as gzip. */
async function unpack(bytes) {
  const packed = new Blob([bytes]).stream();
  return new Uint8Array(await new Response(packed.pipeThrough(new DecompressionStream('gzip'))).arrayBuffer());
}

function decodeBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i += 1) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** The document and the binary chunk of a .glb. */
function parseGlb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.byteLength < 20 || view.getUint32(0, true) !== GLB_MAGIC) throw new Error('not a .glb');
  if (view.getUint32(4, true) !== 2) throw new Error('a .glb of another version than 2');
  let [json, binary] = [null, new Uint8Array(0)];
  for (let at = 12; at + 8 <= bytes.byteLength;) {
    const [length, kind] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    const chunk = bytes.subarray(at + 8, at + 8 + length);
    if (kind === CHUNK_JSON) json = JSON.parse(new TextDecoder().decode(chunk));
    if (kind === CHUNK_BINARY) binary = chunk;
    at += 8 + length;
  }
  if (!json) throw new Error('a .glb without a document');
  return { json, binary };
}
