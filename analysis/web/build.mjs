// Makes one C++ source of the page: node build.mjs SOURCES BUILD OUTPUT.cpp
//
// SOURCES: src/ beside this file; BUILD: where `npm ci` has put node_modules. The page is one HTML file with its style and
// its script inline. It is cut where its data belong (page.html says where), into pieces that every compiler takes.
import {createRequire} from 'node:module';
import {readFileSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';

const [sources, build, output] = process.argv.slice(2).map((path) => resolve(path));
const esbuild = createRequire(join(build, 'package.json'))('esbuild');
const PIECE = 16000; // bytes of a string literal; Clang warns beyond 65536
const LICENSES = ['three'];

function bundle(name) {
  const result = esbuild.buildSync({
    entryPoints: [join(sources, name)],
    nodePaths: [join(build, 'node_modules')],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: ['chrome100', 'firefox100', 'safari15'],
    charset: 'ascii', // whatever encoding a server claims
    legalComments: 'none',
    logLevel: 'warning',
  });
  return result.outputFiles[0].text;
}

function licenses() {
  const text = (name) => readFileSync(join(build, 'node_modules', name, 'LICENSE'), 'utf8').replaceAll('--', '- -');
  return LICENSES.map((name) => `${name}\n\n${text(name)}`).join('\n\n');
}

/** A C++ string literal of some bytes. */
function literal(bytes) {
  let out = '';
  for (const byte of bytes) {
    const plain = byte >= 32 && byte < 127 && byte !== 34 && byte !== 92 && byte !== 63; // no ", \, ? (trigraphs)
    out += plain ? String.fromCharCode(byte) : '\\' + byte.toString(8).padStart(3, '0');
  }
  return `    "${out}"sv`;
}

function literals(text) {
  const bytes = Buffer.from(text, 'utf8');
  const out = [];
  for (let i = 0; i < bytes.length; i += PIECE) out.push(literal(bytes.subarray(i, i + PIECE)));
  return out.join(',\n');
}

const [head, tail] = readFileSync(join(sources, 'page.html'), 'utf8')
  .replace('@LICENSES@', licenses)
  .replace('@STYLE@', () => bundle('style.css'))
  .replace('@SCRIPT@', () => bundle('main.js').replaceAll('</script', '<\\/script'))
  .split('@DATA@');

writeFileSync(output, `// Made from analysis/web by its build.mjs.
#include "jobs/cli/page.h"

namespace graze {

using namespace std::string_view_literals;

const PageTemplate& page_template() {
  static const PageTemplate page = {
    {
${literals(head)}},
    {
${literals(tail)}}};
  return page;
}

}  // namespace graze
`);
