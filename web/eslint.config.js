import js from '@eslint/js'
import svelte from 'eslint-plugin-svelte'
import globals from 'globals'
import ts from 'typescript-eslint'
import svelteConfig from './svelte.config.js'

export default ts.config(
  { ignores: ['dist/', 'node_modules/', 'e2e/shots/', 'src/api.ts'] },
  js.configs.recommended,
  ts.configs.strict,
  svelte.configs.recommended,
  svelte.configs.prettier,
  { languageOptions: { globals: { ...globals.browser, ...globals.node } } },
  {
    files: ['**/*.svelte', '**/*.svelte.ts'],
    languageOptions: { parserOptions: { parser: ts.parser, svelteConfig } },
  },
  {
    // The compiler checks undefined names in TypeScript; the rule knows no types.
    files: ['**/*.ts', '**/*.svelte'],
    rules: {
      'no-undef': 'off',
      // What shall redraw is $state; a Map or URL inside is not meant to.
      'svelte/prefer-svelte-reactivity': 'off',
    },
  },
  {
    // A test that finds nothing where something must be fails either way.
    files: ['**/*.test.ts'],
    rules: { '@typescript-eslint/no-non-null-assertion': 'off' },
  },
)
